"""Where a tip is predicted to come to rest, and how far measured ones are from it."""

from dataclasses import replace

import numpy as np

from flexik.kinematics.crane import forward
from flexik.kinematics.crane_dimensions import DIMENSIONS, corrected
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning.crane_measured.adapted import (
    OFFSETS,
    AdaptationSettings,
    CorrectedDeflection,
    Measurements,
    Offsets,
    displacements,
    prior,
    slope,
    whitening,
)
from flexik.positioning.method import Array, Network


def predicted_tip(
    crane: FlexibleCrane,
    network: Network,
    offsets: Offsets | None,
    strokes: Array,
    payload: Array,
) -> Array:
    """Tip (n, 2) in m at `strokes` (n, 3) in m under `payload` (n,) in kg.

    offsets : of the nominal `crane` whose deflection `network` predicts; None: there are none.
    """
    inputs = np.column_stack([strokes, payload])
    if offsets is None:
        return forward(crane.geometry, strokes) + network.predict(inputs)
    deflection = CorrectedDeflection(crane, network, offsets).predict(inputs)
    return forward(offsets.geometry(crane.geometry), strokes) + deflection


def surprise(
    crane: FlexibleCrane,
    network: Network,
    measurements: Measurements,
    settings: AdaptationSettings,
    offsets: Offsets | None = None,
) -> Array:
    """Distance (n,) of each measured tip from its prediction, in standard deviations.

    The covariance is that of the offsets, of measuring and of repeatability, so the squares of
    these distances have the mean 2 where everything is as expected.

    offsets : identified from other measurements; None: what was expected before measuring.
    """
    if offsets is None:
        expected, deviation = prior(settings)
        offsets = Offsets(dict(zip(OFFSETS, expected.tolist(), strict=True)), np.diag(deviation**2))
    strokes, payload = measurements.strokes, measurements.payload
    residual = measurements.tip - predicted_tip(crane, network, offsets, strokes, payload)
    dimensions = np.array([offsets.values[name] for name in DIMENSIONS])
    known = replace(crane, geometry=corrected(crane.geometry, dimensions))
    share, _ = displacements(known, network, strokes, payload)
    slopes = np.concatenate([slope(crane.geometry, dimensions, strokes), share], axis=2)
    white = whitening(known, measurements, settings)
    spread = white @ slopes
    covariance = spread @ offsets.covariance @ spread.transpose(0, 2, 1) + np.eye(2)
    distance = (white @ residual[..., None])[..., 0]
    return np.sqrt(np.einsum("ni,nij,nj->n", distance, np.linalg.inv(covariance), distance))
