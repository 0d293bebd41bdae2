# SPDX-License-Identifier: Apache-2.0
"""The scene as the viewport's dependency graph has it, modifiers and instances included, in arrays
that need no Blender afterwards."""
import numpy

SURFACES = ("MESH", "CURVE", "SURFACE", "FONT", "META")


class Shape:
    """An evaluated mesh in its own space, shared by its instances."""

    def __init__(self, mesh):
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        self.positions = _read(mesh.vertices, "co", "f4", (len(mesh.vertices), 3))
        self.triangles = _read(mesh.loop_triangles, "vertices", "i4", (count, 3))
        self.loops = _read(mesh.loop_triangles, "loops", "i4", (count, 3))
        self.materials = _read(mesh.loop_triangles, "material_index", "i4", (count,))
        self.corners = _corner_normals(mesh)
        self.vertex_of = _read(mesh.loops, "vertex_index", "i4", (len(mesh.loops),))
        self.uvs = None
        layer = mesh.uv_layers.active
        if layer:
            self.uvs = _read(layer.data, "uv", "f4", (len(mesh.loops), 2))

    def vertex_normals(self):
        """Sums of the corners' normals around each vertex: the library takes any length."""
        total = numpy.zeros_like(self.positions)
        numpy.add.at(total, self.vertex_of, self.corners)
        return total


class Placed:
    """A shape in the world."""

    def __init__(self, shape, instance, obj):
        self.shape = shape
        self.matrix = numpy.array(instance.matrix_world, numpy.float64)
        # normals are covectors: right under any scale, and outward under a mirror
        with numpy.errstate(all="ignore"):
            inverse = numpy.linalg.pinv(self.matrix[:3, :3])
        self.normal_matrix = inverse.T
        self.hand = numpy.sign(numpy.linalg.det(self.matrix[:3, :3]))  # a mirror turns faces over
        self.name = "" if instance.is_instance else obj.original.name_full
        self.casts = getattr(obj, "visible_shadow", True)
        self.seen = getattr(obj, "visible_camera", True)
        self.colours = [_colour(slot.material) for slot in obj.material_slots] or [_colour(None)]

    def world(self, positions):
        return positions @ self.matrix[:3, :3].T + self.matrix[:3, 3]

    def normals(self, normals):
        out = (normals @ self.normal_matrix.T).astype(numpy.float32)
        length = numpy.linalg.norm(out, axis=1)[:, None]
        return numpy.divide(out, length, out=out, where=length > 0)


class Lamp:
    """A light in the world. It keeps no reference to Blender's data."""

    def __init__(self, instance, obj, engine):
        light = obj.data
        self.name = obj.original.name_full
        self.matrix = numpy.array(instance.matrix_world, numpy.float64)
        for field in ("type", "color", "energy", "shadow_soft_size", "angle", "shape", "size",
                      "size_y", "spot_size", "spot_blend"):
            value = getattr(light, field, None)
            setattr(self, field, tuple(value) if field == "color" else value)
        self.selected = not instance.is_instance and obj.original.select_get()
        cycles = getattr(light, "cycles", None)
        self.casts = bool(getattr(cycles, "cast_shadow", light.use_shadow) if engine == "CYCLES"
                          else light.use_shadow)


class World:
    """Everything that casts, receives or shines."""

    def __init__(self, context):
        graph = context.evaluated_depsgraph_get()
        self.placed, self.lamps, shapes = [], [], {}
        for instance in graph.object_instances:
            obj = instance.object
            if obj.type == "LIGHT":
                self.lamps.append(Lamp(instance, obj, context.scene.render.engine))
            elif obj.type in SURFACES and instance.show_self:
                shape = _shape(shapes, instance, obj)
                if shape:
                    self.placed.append(Placed(shape, instance, obj))
        _make_names_differ(self.lamps)
        world = context.scene.world
        self.background = tuple(world.color) if world else (0, 0, 0)

    def find(self, obj):
        """Where an object of the scene stands, or None: an instance is not the object."""
        return next((p for p in self.placed if p.name == obj.name_full), None)


def _shape(shapes, instance, obj):
    # Instances share the mesh they show; what is no mesh becomes one, for each object anew.
    source = obj if obj.type == "MESH" else instance.instance_object or obj
    key = obj.data.as_pointer(), 0 if obj.type == "MESH" else source.as_pointer()
    if key not in shapes:
        try:
            mesh = obj.to_mesh()
        except RuntimeError:  # a curve without anything to draw
            mesh = None
        shapes[key] = Shape(mesh) if mesh and len(mesh.polygons) else None
        obj.to_mesh_clear()
    return shapes[key]


def _read(collection, field, kind, shape):
    # float32 and int32 are what Blender holds: anything else goes a slow way
    out = numpy.empty(shape, kind)
    collection.foreach_get(field, out.ravel())
    return out


def _corner_normals(mesh):
    count = len(mesh.loops)
    if hasattr(mesh, "corner_normals"):  # 4.1
        return _read(mesh.corner_normals, "vector", "f4", (count, 3))
    mesh.calc_normals_split()
    return _read(mesh.loops, "normal", "f4", (count, 3))


def _colour(material):
    if not material:
        return (0.8, 0.8, 0.8)
    nodes = material.node_tree.nodes if material.use_nodes and material.node_tree else ()
    for node in nodes:
        if node.type in ("BSDF_PRINCIPLED", "BSDF_DIFFUSE"):
            return tuple(node.inputs[0].default_value)[:3]
    return tuple(material.diffuse_color)[:3]


def _make_names_differ(lamps):
    seen = {}
    for lamp in lamps:
        seen[lamp.name] = seen.get(lamp.name, 0) + 1
        if seen[lamp.name] > 1:
            lamp.name += " (%d)" % seen[lamp.name]
