"""What the texts and the memory of video models come to, without any weights."""
