"""A short notation for Blender shader trees: each method adds one node and returns its output."""

from __future__ import annotations

from typing import Any

Value = Any
"""An output socket, or a number, or a tuple for a colour or vector."""


class Nodes:
    """Builds nodes into one tree; sockets and plain numbers mix freely as arguments."""

    def __init__(self, tree: Any) -> None:
        """Take an empty or filled node tree; what is in it is cleared."""
        self.tree = tree
        tree.nodes.clear()

    def add(self, kind: str, **settings: Any) -> Any:
        """Add a node of a Blender type and set its properties."""
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def put(self, socket: Any, value: Value) -> None:
        """Link a socket, or set its default value."""
        if hasattr(value, "is_output"):
            self.tree.links.new(value, socket)
        elif isinstance(value, tuple) and socket.type == "RGBA" and len(value) == 3:
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def math(self, operation: str, a: Value, b: Value = 0.0, c: Value = 0.0, clamp: bool = False) -> Any:
        """One scalar operation, e.g. MULTIPLY or LESS_THAN."""
        node = self.add("ShaderNodeMath", operation=operation, use_clamp=clamp)
        for socket, value in zip(node.inputs, (a, b, c), strict=False):
            self.put(socket, value)
        return node.outputs[0]

    def vector(self, operation: str, a: Value, b: Value = (0.0, 0.0, 0.0)) -> Any:
        """One vector operation; LENGTH and DOT_PRODUCT come back as numbers."""
        node = self.add("ShaderNodeVectorMath", operation=operation)
        self.put(node.inputs[0], a)
        self.put(node.inputs[1], b)
        return node.outputs["Value"] if operation in {"LENGTH", "DOT_PRODUCT", "DISTANCE"} else node.outputs[0]

    def combine(self, x: Value, y: Value, z: Value = 0.0) -> Any:
        """A vector of three numbers."""
        node = self.add("ShaderNodeCombineXYZ")
        for socket, value in zip(node.inputs, (x, y, z), strict=True):
            self.put(socket, value)
        return node.outputs[0]

    def split(self, vector: Value) -> tuple[Any, Any, Any]:
        """The three numbers of a vector."""
        node = self.add("ShaderNodeSeparateXYZ")
        self.put(node.inputs[0], vector)
        return node.outputs[0], node.outputs[1], node.outputs[2]

    def noise(self, at: Value, scale: float, detail: float = 2.0, roughness: float = 0.5) -> Any:
        """Fractal noise about 0.5 of wavelength 1 / scale."""
        node = self.add("ShaderNodeTexNoise", noise_dimensions="3D", normalize=True)
        self.put(node.inputs["Vector"], at)
        self.put(node.inputs["Scale"], scale)
        self.put(node.inputs["Detail"], detail)
        self.put(node.inputs["Roughness"], roughness)
        return node.outputs["Fac"]

    def cells(self, at: Value, scale: float) -> tuple[Any, Any]:
        """Voronoi cells: the distance to the nearest centre (in cells) and the cell's random colour."""
        node = self.add("ShaderNodeTexVoronoi", voronoi_dimensions="3D", feature="F1")
        self.put(node.inputs["Vector"], at)
        self.put(node.inputs["Scale"], scale)
        return node.outputs["Distance"], node.outputs["Color"]

    def random(self, at: Value) -> Any:
        """White noise 0..1 of a vector: one value per panel, brick or cell."""
        node = self.add("ShaderNodeTexWhiteNoise", noise_dimensions="3D")
        self.put(node.inputs["Vector"], at)
        return node.outputs["Value"]

    def ramp(self, value: Value, low: Value, high: Value, to_low: Value = 0.0, to_high: Value = 1.0) -> Any:
        """Map low..high smoothly to to_low..to_high, held beyond."""
        node = self.add("ShaderNodeMapRange", interpolation_type="SMOOTHSTEP", clamp=True)
        for socket, given in zip(node.inputs, (value, low, high, to_low, to_high), strict=False):
            self.put(socket, given)
        return node.outputs[0]

    def mix(self, factor: Value, a: Value, b: Value, blend: str = "MIX") -> Any:
        """Blend two colours."""
        node = self.add("ShaderNodeMix", data_type="RGBA", blend_type=blend, clamp_factor=True)
        self.put(node.inputs[0], factor)
        self.put(node.inputs[6], a)
        self.put(node.inputs[7], b)
        return node.outputs[2]

    def brighten(self, colour: Value, factor: Value) -> Any:
        """Multiply a colour by a number."""
        node = self.add("ShaderNodeVectorMath", operation="SCALE")
        self.put(node.inputs[0], colour)
        self.put(node.inputs["Scale"], factor)
        return node.outputs[0]
