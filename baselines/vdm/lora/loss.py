"""Flow matching on what follows the frames that are given."""

from typing import Any

import torch

from mpmworlds.baselines.vdm.backends.wan_pipeline import (
    Pipeline,
    Tensor,
    control_of,
    latents_of,
)
from mpmworlds.baselines.vdm.lora.windows import Window
from mpmworlds.baselines.vdm.memory import STRIDE


def continuation_loss(
    pipe: Pipeline,
    model: Any,
    window: Window,
    text: Tensor,
    shift: float,
    dtype: torch.dtype,
) -> Tensor:
    """Mean squared error of the velocity, on the latents of the continuation.

    With clean latents x0, noise e and its level s, the model sees (1 - s) x0 + s e and
    is to give e - x0 [Lipman et al. 2023, eq. 23]. s is logit-normal [Esser et al.
    2024, eq. 19], shifted as in sampling. Latents that are given take part in attention
    and not in the loss: predictions never use what the model makes of them.

    Parameters
    ----------
    pipe
        Whose encoder of videos is used.
    model
        Its transformer, wrapped or not.
    window
        What is seen.
    text
        Its text, of `Texts.embedded`.
    shift
        Of the noise levels.
    dtype
        In which the model computes.
    """
    generator = torch.Generator().manual_seed(window.seed)
    clean = latents_of(pipe, window.frames).float()
    new = len(window.frames) - window.given
    control = control_of(pipe, window.frames[: window.given], new)
    level = noise_level(generator, shift).to(clean.device)
    noise = torch.randn(clean.shape, generator=generator).to(clean.device)
    predicted = model(
        hidden_states=((1 - level) * clean + level * noise).to(dtype),
        timestep=level * pipe.scheduler.config.num_train_timesteps,
        encoder_hidden_states=text.to(clean.device, dtype),
        control_hidden_states=control.to(dtype),
        return_dict=False,
    )[0]
    known = (window.given - 1) // STRIDE + 1
    error = predicted.float() - (noise - clean)
    loss: Tensor = error[:, :, known:].square().mean()
    return loss


def noise_level(generator: torch.Generator, shift: float) -> Tensor:
    """A level (1,) in (0, 1): s = shift u / (1 + (shift - 1) u), u logit-normal."""
    level = torch.randn(1, generator=generator).sigmoid()
    return shift * level / (1 + (shift - 1) * level)
