"""Programs by a vision language model, Qwen2.5-VL, and its full finetuning.

`predictor` asks a model that runs here, `training` finetunes one; both need the extra
``vlm``. Models that run elsewhere are asked by `mpmworlds.baselines.served`.
"""
