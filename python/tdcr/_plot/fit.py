"""Pictures of fits. Imported on first use by ``Fit.plot`` and ``Fit.plot_residuals``."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["plot_distances", "plot_residuals"]

Array: TypeAlias = NDArray[np.float64]

_BEFORE, _AFTER, _FITTED = "#9AA5B1", "#C8553D", "#2A6F97"


def plot_distances(before: Array, after: Array, whose: str, ax: Any) -> Any:
    """Draw the shares of points within a distance [m], before and after; see `Fit.plot`."""
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(layout="constrained").add_subplot()
    for given, colour, label in ((before, _BEFORE, "before"), (after, _AFTER, "after")):
        distances = np.sort(given) * 1e3
        share = np.arange(len(distances) + 1) / len(distances)
        label = f"{label}, mean {float(np.mean(given)) * 1e3:.3g} mm"
        ax.step([0.0, *distances], share, where="post", color=colour, label=label)
    ax.set(xlabel="distance [mm]", ylabel=f"share of the {whose} points", ylim=(0, 1.03))
    ax.grid(True)
    ax.legend(frameon=False)
    return ax


def plot_residuals(
    before: Array, after: Array, rows: NDArray[np.int64], held_out: NDArray[np.bool_], axes: Any
) -> Any:
    """Draw residuals (rows, points, 3) [m] along x, y and z; see `Fit.plot_residuals`."""
    if axes is None:
        from matplotlib.figure import Figure

        axes = Figure(figsize=(7.0, 5.5), layout="constrained").subplots(3, sharex=True)
    # One mark per point, at its row.
    points = after.shape[1]
    places, held = np.repeat(rows, points), np.repeat(held_out, points)
    looks = [
        (before, np.ones_like(held), "before", _BEFORE, "none"),
        (after, ~held, "after, fitted to", _FITTED, "none"),
        (after, held, "after, held out", _AFTER, _AFTER),
    ]
    # Outliers are drawn at the edge.
    limit = 2 * float(np.percentile(np.abs(np.concatenate([before, after])) * 1e3, 99)) or 1.0
    for c, axis in enumerate("xyz"):
        ax, beyond = axes[c], 0
        for values, which, label, edge, face in looks:
            if which.any():
                own = values[..., c].ravel()[which] * 1e3
                beyond += int((np.abs(own) > limit).sum())
                style = {"facecolors": face, "edgecolors": edge, "linewidths": 0.7}
                ax.scatter(places[which], own.clip(-limit, limit), s=9, label=label, **style)
        ax.axhline(0, color="0.3", linewidth=0.8, zorder=0)
        if beyond:
            ax.text(0.99, 0.06, f"{beyond} beyond", transform=ax.transAxes, ha="right")
        ax.set_ylabel(f"{axis} [mm]")
        ax.grid(True, linewidth=0.4)
    # The legend takes the right of the title's line.
    axes[2].set_xlabel("row of the measurements")
    ax = axes[0]
    ax.set_title("measured minus predicted", fontsize=10)
    ax.legend(frameon=False, ncols=3, fontsize=8, loc="lower right", bbox_to_anchor=(1, 1))
    ax.title.set_horizontalalignment("left")
    ax.title.set_x(0)
    return axes
