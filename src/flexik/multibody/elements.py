"""Beams in Exudyn: geometrically exact or ANCF elements behind one door.

geometrically_exact : two-node element with one integration point (Simo 1985, Reissner's beam). Its
    shear stiffness is set so that the element bends exactly like an Euler-Bernoulli beam under end
    forces (residual bending flexibility, MacNeal 1978); shear flexibility itself is neglected.
ancf : two-node absolute nodal coordinate cable element without shear (Gerstmayr and Irschik 2008).
"""

from dataclasses import dataclass, field

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item

from flexik.multibody.structure import Array, Elements

ELEMENTS = ("geometrically_exact", "ancf")


@dataclass(frozen=True)
class PlacedBeam:
    """A beam in an Exudyn system; stations (m + 1,) in m, nodes and objects as Exudyn numbers."""

    system: exu.MainSystem
    ancf: bool
    stations: Array
    nodes: list[int]
    objects: list[int]
    _arms: dict[int, int] = field(default_factory=dict)

    def marker(self, abscissa: float, offset: float = 0.0) -> int:
        """Marker at `abscissa`, `offset` left of the axis, in m, on a rigid arm from a node."""
        k = int(np.argmin(np.abs(self.stations - abscissa)))
        ahead = abscissa - self.stations[k]
        if self.ancf:
            element = max(k - 1, 0)
            body, x = self.objects[element], self.stations[k] - self.stations[element] + ahead
        else:
            # this element offers points on its axis only: a massless body on the node is the arm
            if k not in self._arms:
                arm = item.ObjectRigidBody2D(nodeNumber=self.nodes[k])
                self._arms[k] = self.system.AddObject(arm)
            body, x = self._arms[k], ahead
        marker = item.MarkerBodyRigid(bodyNumber=body, localPosition=[x, offset, 0.0])
        return self.system.AddMarker(marker)

    def coordinate_marker(self, node: int, coordinate: int) -> int:
        """Marker on coordinate x (0), y (1), or, small and of an upright beam, rotation (2)."""
        marker = item.MarkerNodeCoordinate(nodeNumber=self.nodes[node], coordinate=coordinate)
        return self.system.AddMarker(marker)

    def move(self, origin: Array, angle: float) -> None:
        """Put the reference configuration at `origin` (2,) in m and `angle` in rad."""
        references = _references(self.ancf, self.stations, origin, angle)
        for node, reference in zip(self.nodes, references, strict=True):
            self.system.SetNodeParameter(node, "referenceCoordinates", reference)

    def shape(self) -> Array:
        """Node positions (m + 1, 2) in m of the current solution."""
        position = exu.OutputVariableType.Position
        return np.array([self.system.GetNodeOutput(n, position)[:2] for n in self.nodes])


def place_beam(
    system: exu.MainSystem, element: str, elements: Elements, origin: Array, angle: float
) -> PlacedBeam:
    """Add a straight beam whose abscissa 0 lies at `origin` (2,) in m, axis at `angle` in rad."""
    ancf = element == "ancf"
    node_type = item.NodePoint2DSlope1 if ancf else item.NodeRigidBody2D
    nodes = [
        system.AddNode(node_type(referenceCoordinates=reference))
        for reference in _references(ancf, elements.stations, origin, angle)
    ]
    objects = []
    for k, length in enumerate(np.diff(elements.stations)):
        common = {
            "nodeNumbers": nodes[k : k + 2],
            "length": length,
            "bendingStiffness": elements.bending_stiffness[k],
            "axialStiffness": elements.axial_stiffness[k],
        }
        objects.append(
            system.AddObject(
                item.ObjectANCFCable2D(useReducedOrderIntegration=1, **common)
                if ancf
                else item.ObjectBeamGeometricallyExact2D(
                    shearStiffness=length / elements.residual_flexibility[k],
                    includeReferenceRotations=True,
                    **common,
                )
            )
        )
    return PlacedBeam(system, ancf, elements.stations, nodes, objects)


def _references(ancf: bool, stations: Array, origin: Array, angle: float) -> list[list[float]]:
    """Reference coordinates of the nodes of a straight beam."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    orientation = list(direction) if ancf else [angle]
    return [[*point, *orientation] for point in origin + stations[:, None] * direction]
