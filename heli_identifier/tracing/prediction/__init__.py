"""Prediction-error identification: an observer's innovations, their sensitivities, whitening and fit."""
