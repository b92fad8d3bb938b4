"""Simple predictors, a module each: what has a name here is a predictor."""
