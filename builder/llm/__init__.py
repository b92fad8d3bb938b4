"""Scenes proposed by a language model, as in Self-Instruct [Wang et al. 2023].

A numbered `request` shows the model some seeds, or one parent and an edit. The `client`
asks an OpenAI-compatible endpoint and the `transcript` keeps what it said, so that a
later run asks only what is missing. `replies` reads scenes out of the answers,
`agreement` compares a program with its scene, and `proposals` puts it together.
"""
