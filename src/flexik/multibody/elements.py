"""Beams in Exudyn: geometrically exact or ANCF elements behind one door.

geometrically_exact : two-node element with one integration point (Simo 1985, Reissner's beam). Its
    shear stiffness is set so that the element bends exactly like an Euler-Bernoulli beam under end
    forces (residual bending flexibility, MacNeal 1978); shear flexibility itself is neglected.
ancf : two-node absolute nodal coordinate cable element without shear (Gerstmayr and Irschik 2008).
"""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from flexik.multibody.beams import Array, Elements, nearest

# Node and element in Exudyn: dictionaries, which it takes two to three times faster than its item
# classes, but without complaint about unknown keys
_ITEMS: dict[str, tuple[str, dict[str, Any]]] = {
    "geometrically_exact": (
        "RigidBody2D",
        {"objectType": "BeamGeometricallyExact2D", "includeReferenceRotations": True},
    ),
    "ancf": ("Point2DSlope1", {"objectType": "ANCFCable2D", "useReducedOrderIntegration": 1}),
}
ELEMENTS = tuple(_ITEMS)


@dataclass
class PlacedBeam:
    """A beam in an Exudyn system; stations (m + 1,) in m, nodes and objects as Exudyn numbers.

    places : (m + 1, 2) in m, where the nodes lie in the frame of the body, whose x is the axis if
        not given; only geometrically exact elements may lie along other lines.
    tilt : angle of a straight axis in that frame, rad.
    """

    system: exu.MainSystem
    ancf: bool
    stations: Array
    nodes: list[int]
    objects: list[int]
    places: Array
    tilt: float = 0.0
    _arms: dict[int, int] = field(default_factory=dict)
    _markers: dict[int, tuple[int, float, float]] = field(default_factory=dict)

    def marker(self, abscissa: float, offset: float = 0.0) -> int:
        """Marker at `abscissa`, `offset` left of the axis, in m, on a rigid arm from a node."""
        k = nearest(self.stations, abscissa)
        return self._marker(k, abscissa - self.stations[k], offset)

    def marker_at(self, abscissa: float, point: Array) -> int:
        """Marker at `point` (2,) of the body, in m, on a rigid arm from the node at `abscissa`."""
        k = nearest(self.stations, abscissa)
        return self._marker(k, *self._from_node(k, point))

    def _from_node(self, k: int, point: Array) -> tuple[float, float]:
        """`point` from node k, along and left of the reference direction of the node."""
        x, y = point - self.places[k]
        c, s = (float(f(self.tilt)) for f in (np.cos, np.sin)) if self.ancf else (1.0, 0.0)
        return float(c * x + s * y), float(c * y - s * x)

    def _marker(self, k: int, ahead: float, offset: float) -> int:
        if self.ancf:
            body = self.objects[max(k - 1, 0)]
        else:
            # this element offers points on its axis only: a massless body on the node is the arm
            if k not in self._arms:
                arm = {"objectType": "RigidBody2D", "nodeNumber": self.nodes[k]}
                self._arms[k] = self.system.AddObject(arm)
            body = self._arms[k]
        marker = self.system.AddMarker({"markerType": "BodyRigid", "bodyNumber": body})
        self._put(marker, k, ahead, offset)
        return marker

    def slide(self, marker: int, abscissa: float) -> None:
        """Put a marker at another `abscissa` in m, on the arm from its node."""
        k, _, offset = self._markers[marker]
        self._put(marker, k, abscissa - self.stations[k], offset)

    def slide_to(self, marker: int, point: Array) -> None:
        """Put a marker at another `point` (2,) of the body in m, on the arm from its node."""
        k = self._markers[marker][0]
        self._put(marker, k, *self._from_node(k, point))

    def shift(self, marker: int, by: Array) -> None:
        """Hold a marker `by` (2,) in m, ground frame, off its place; the next shift replaces it."""
        node, ahead, offset = self._markers[marker]
        if by.any():
            angle = self.rotation(node)
            c, s = float(np.cos(angle)), float(np.sin(angle))
            ahead, offset = ahead + c * by[0] + s * by[1], offset - s * by[0] + c * by[1]
        self._set_position(marker, node, ahead, offset)

    def rotation(self, node: int) -> float:
        """Angle of a node from x in the current solution, rad."""
        return rotation_of(self.system, self.nodes[node])

    def position(self, node: int) -> Array:
        """Place (2,) of a node in the current solution, m."""
        position = exu.OutputVariableType.Position
        return np.array(self.system.GetNodeOutput(self.nodes[node], position)[:2])

    def axial_strain(self, station: int) -> float:
        """Axial strain of the element that begins at a station, the same all along it.

        At the last station, that of the last element.
        """
        element = self.objects[min(station, len(self.objects) - 1)]
        strain = exu.OutputVariableType.StrainLocal
        return float(self.system.GetObjectOutputBody(element, strain, [0.0, 0.0, 0.0])[0])

    def _put(self, marker: int, node: int, ahead: float, offset: float) -> None:
        self._markers[marker] = (node, ahead, offset)
        self._set_position(marker, node, ahead, offset)

    def _set_position(self, marker: int, node: int, ahead: float, offset: float) -> None:
        """Place a marker relative to its node; bodies of ANCF markers begin at the node before."""
        start = self.stations[node] - self.stations[max(node - 1, 0)] if self.ancf else 0.0
        self.system.SetMarkerParameter(marker, "localPosition", [start + ahead, offset, 0.0])

    def coordinate_marker(self, node: int, coordinate: int) -> int:
        """Marker on coordinate x (0), y (1), or, small and of an upright beam, rotation (2)."""
        marker = {"markerType": "NodeCoordinate", "nodeNumber": self.nodes[node]}
        return self.system.AddMarker({**marker, "coordinate": coordinate})

    def reshape(self, elements: Elements, places: Array | None = None) -> None:
        """Take over as many other `elements`; markers stay as far from their nodes as they are."""
        self.stations = elements.stations
        self.places = _along_x(elements.stations) if places is None else places
        length = np.diff(elements.stations)
        parameters = {
            "length": length,
            "bendingStiffness": elements.bending_stiffness,
            "axialStiffness": elements.axial_stiffness,
        }
        if not self.ancf:
            parameters["shearStiffness"] = length / elements.residual_flexibility
        for name, values in parameters.items():
            for number, value in zip(self.objects, values.tolist(), strict=True):
                self.system.SetObjectParameter(number, name, value)
        if self.ancf:
            for marker, place in self._markers.items():
                self._put(marker, *place)

    def move(self, origin: Array, angle: float) -> None:
        """Put the reference configuration at `origin` (2,) in m and `angle` in rad."""
        references = _references(self.ancf, self.places, origin, angle, self.tilt)
        for node, reference in zip(self.nodes, references, strict=True):
            self.system.SetNodeParameter(node, "referenceCoordinates", reference)

    @property
    def n_coordinates(self) -> int:
        """Coordinates of all nodes."""
        return len(self.nodes) * (4 if self.ancf else 3)

    def turned(self, displacements: Array, by: float) -> Array:
        """Displacements of all nodes (n_coordinates,) of the beam when it is turned `by` rad."""
        turned = displacements.reshape(len(self.nodes), -1).copy()
        c, s = np.cos(by), np.sin(by)
        for k in range(0, turned.shape[1] - 1, 2):  # positions, of ANCF nodes slopes too
            turned[:, k : k + 2] = turned[:, k : k + 2] @ np.array([[c, s], [-s, c]])
        return turned.ravel()

    def shape(self) -> Array:
        """Node positions (m + 1, 2) in m of the current solution."""
        position = exu.OutputVariableType.Position
        return np.array([self.system.GetNodeOutput(n, position)[:2] for n in self.nodes])


@dataclass
class PlacedBody:
    """A rigid body in an Exudyn system: its node and object."""

    system: exu.MainSystem
    node: int
    body: int
    n_coordinates: int = 3

    def move(self, origin: Array, angle: float) -> None:
        """Put the reference configuration at `origin` (2,) in m and `angle` in rad."""
        self.system.SetNodeParameter(self.node, "referenceCoordinates", [*origin.tolist(), angle])

    def turned(self, displacements: Array, by: float) -> Array:
        """Displacements (3,) when the body is turned `by` rad."""
        c, s = np.cos(by), np.sin(by)
        x, y, rotation = displacements
        return np.array([c * x - s * y, s * x + c * y, rotation])


def rotation_of(system: exu.MainSystem, node: int) -> float:
    """Angle of a node from x in the current solution, rad; of an ANCF node that of its slope."""
    moved = system.GetNodeOutput(node, exu.OutputVariableType.Coordinates)
    turned = np.add(moved, system.GetNodeParameter(node, "referenceCoordinates"))[2:]
    return float(np.arctan2(turned[1], turned[0]) if len(turned) > 1 else turned[0])


def place_beam(
    system: exu.MainSystem,
    element: str,
    elements: Elements,
    origin: Array,
    angle: float,
    places: Array | None = None,
    tilt: float = 0.0,
) -> PlacedBeam:
    """Add a beam whose frame lies at `origin` (2,) in m and `angle` in rad; see PlacedBeam."""
    ancf = element == "ancf"
    node_type, element_type = _ITEMS[element]
    nodes = [system.AddNode({"nodeType": node_type}) for _ in elements.stations]
    if not ancf and places is not None:
        # nodes turn with the body, whatever the direction of an axis that may have corners
        element_type = {**element_type, "includeReferenceRotations": False}
    objects = [system.AddObject({**element_type, "nodeNumbers": list(p)}) for p in pairwise(nodes)]
    along = _along_x(elements.stations)
    beam = PlacedBeam(system, ancf, elements.stations, nodes, objects, along, tilt)
    beam.reshape(elements, places)
    beam.move(origin, angle)
    return beam


def pin(system: exu.MainSystem, first: int, second: int) -> int:
    """Make two markers one point; returns the joint."""
    return system.AddObject({"objectType": "JointRevolute2D", "markerNumbers": [first, second]})


def pad(system: exu.MainSystem, touched: int, line: float, other: int, other_line: float) -> None:
    """Keep marker `other` on a line through marker `touched`, at these angles in their frames."""
    pair = {"markerNumbers": [touched, other], "constrainRotation": False}
    axis = [float(np.cos(line)), float(np.sin(line)), 0.0]
    normal = [-float(np.sin(other_line)), float(np.cos(other_line)), 0.0]
    joint = {"objectType": "JointPrismatic2D", "axisMarker0": axis, "normalMarker1": normal}
    system.AddObject({**joint, **pair})


def spring(system: exu.MainSystem, markers: list[int], x: Any, y: Any) -> None:
    """Springs between two markers in the first one's frame, N/m; rigid where there is none."""
    stiffness = np.diag([x or 0.0, y or 0.0, 0.0, 0.0, 0.0, 0.0])
    connector = {"objectType": "ConnectorRigidBodySpringDamper", "markerNumbers": markers}
    system.AddObject({**connector, "stiffness": stiffness})
    if not (x and y):
        # a pad's line turns with its second marker, and the spring is the first one's
        along = 0.0 if x else np.pi / 2
        pad(system, markers[1], along, markers[0], along)


def hang(system: exu.MainSystem, marker: int, mass: float, gravity: float) -> int:
    """Hang `mass` in kg on a marker; returns the load, whose mass `weigh` changes."""
    load = system.AddLoad({"loadType": "ForceVector", "markerNumber": marker})
    weigh(system, load, mass, gravity)
    return load


def weigh(system: exu.MainSystem, load: int, mass: float, gravity: float) -> None:
    """Set a load to the weight of `mass` in kg."""
    system.SetLoadParameter(load, "loadVector", [0.0, -mass * gravity, 0.0])


def neighbours(coordinates: Array, payload: Array) -> NDArray[np.int64]:
    """Order (n,) in which each sample of coordinates (n, k) and payload (n,) is near the last one.

    To and fro in cells; those of equal coordinates follow each other by their payload.
    """
    if not len(payload):
        return np.zeros(0, dtype=np.int64)
    places, group = np.unique(coordinates, axis=0, return_inverse=True)
    least = np.full(len(places), np.inf)
    np.minimum.at(least, group, payload)
    points = np.column_stack([least, places[:, ::-1]])
    n_cells = max(1, round(len(points) ** (1 / points.shape[1])))
    size = np.ptp(points, axis=0)
    share = (points - points.min(axis=0)) / np.where(size > 0.0, size, 1.0)
    cells = np.minimum((n_cells * share).astype(np.int64), n_cells - 1)
    for k in range(1, points.shape[1]):
        back = cells[:, :k].sum(axis=1) % 2 == 1
        cells[back, k] = n_cells - 1 - cells[back, k]
    rank = np.empty(len(points), dtype=np.int64)
    rank[np.lexsort(cells.T[::-1])] = np.arange(len(points))
    return np.lexsort((payload, rank[group]))


def _along_x(stations: Array) -> Array:
    return np.column_stack([stations, np.zeros(len(stations))])


def _references(
    ancf: bool, places: Array, origin: Array, angle: float, tilt: float
) -> list[list[float]]:
    """Reference coordinates of the nodes of a beam."""
    c, s = np.cos(angle), np.sin(angle)
    points = (
        origin + places[:, :1] * np.array([c, s]) + places[:, 1:] * np.array([-s, c])
    ).tolist()
    orientation = [float(np.cos(angle + tilt)), float(np.sin(angle + tilt))] if ancf else [angle]
    return [[*point, *orientation] for point in points]
