"""Models of a robot's shape, with the classes of their settings: a new one is registered here."""

from __future__ import annotations

from typing import TypeAlias

from tdcr._core import ConstantCurvatureSettings, LinkageSettings, RodSettings

__all__ = ["MODELS", "Settings"]

Settings: TypeAlias = RodSettings | LinkageSettings | ConstantCurvatureSettings

MODELS = {
    "rod": RodSettings,
    "linkage": LinkageSettings,
    "constant_curvature": ConstantCurvatureSettings,
}
"""Classes of settings by the name of the model, the default first."""
