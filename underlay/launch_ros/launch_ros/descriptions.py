"""Descriptions of parameters, under their other name."""

from underlay_refusal import refuse

from .parameter_descriptions import ParameterFile, ParameterValue

__all__ = ['ParameterFile', 'ParameterValue']
__getattr__ = refuse(__name__, __all__)
