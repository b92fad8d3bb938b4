"""How a finetuning goes: samples in their order, the loss, the trainer, a run."""
