"""Trained models, predictions and their members as files."""

from .model_file import load as load
from .model_file import save as save
from .prediction_file import load_prediction as load_prediction
from .prediction_file import save_prediction as save_prediction
from .whole_file import FlowFileError as FlowFileError
