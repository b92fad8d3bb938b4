"""Programs by a model behind any OpenAI-compatible server (extra ``served``).

A room of its own, beside `mpmworlds.baselines.vlm`: it needs no torch, sees any model,
and what it has in common with that one is `mpmworlds.baselines.learned.writing`.
"""
