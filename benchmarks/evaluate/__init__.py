"""What an evaluation costs beside the candidates themselves."""
