# SPDX-License-Identifier: Apache-2.0
"""The operators: gather in the main thread, ask in another, write the answers in the main thread."""
import bpy
import numpy

from . import ask, cover, gather, library, places, preview, results

_running = []  # the job of the operator that runs: one at a time


class _Asks:
    """An operator in two halves: prepare(context, settings) returns work(job) that needs no Blender,
    finish(context, answer) writes what that returned."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return not _running and context.mode == "OBJECT"

    def execute(self, context):
        """From scripts: in one go."""
        job = self._begin(context)
        if not job:
            return {"CANCELLED"}
        job.run()
        return self._end(context, job)

    def invoke(self, context, _event):
        """From the user interface: with a progress bar, until it is done or Esc is pressed."""
        job = self._begin(context)
        if not job:
            return {"CANCELLED"}
        _running.append(job)
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.05, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        job.start()
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job = _running[0]
        if event.type == "ESC" and event.value == "PRESS":
            job.cancel()
        if event.type != "TIMER":
            # nothing may change below the answers on their way
            return {"RUNNING_MODAL"}
        context.window_manager.progress_update(100 * job.done)
        context.workspace.status_text_set("Soft shadows: %d %%      Esc: stop" % (100 * job.done))
        if job.running():
            return {"RUNNING_MODAL"}
        self._leave(context)
        return self._end(context, job)

    def cancel(self, context):
        """Blender ends the operator, as when its window is closed."""
        _running[0].cancel()
        self._leave(context)

    def _leave(self, context):
        _running.clear()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)

    def _begin(self, context):
        package, why = library.load()
        if not package:
            self.report({"ERROR"}, why)
            return None
        given = context.scene.softshadow
        settings = {name: getattr(given, name) for name in given.bl_rna.properties.keys()
                    if name not in ("rna_type", "name")}
        settings["weighting"] = settings["weighting"].lower()
        try:
            world = gather.World(context)
            lamps = [lamp for lamp in world.lamps
                     if lamp.selected or settings["lights"] == "ALL"]
            if not lamps:
                raise ValueError("no light is selected" if world.lamps else "there is no light")
            work = self.prepare(context, world, lamps, settings)
        except (ValueError, package.Error) as error:
            self.report({"ERROR"}, str(error))
            return None

        def compute(job):
            questions = ask.Questions(package, world, lamps, settings, job)
            with questions.scene:
                return work(questions, job)
        return ask.Job(compute)

    def _end(self, context, job):
        if job.cancelled():
            self.report({"INFO"}, "Soft shadows: stopped")
            return {"CANCELLED"}
        if job.error:
            self.report({"ERROR"}, str(job.error) or repr(job.error))
            return {"CANCELLED"}
        self.report({"INFO"}, "Soft shadows: " + self.finish(context, job.result))
        return {"FINISHED"}


class _Bakes(_Asks):
    """Of the selected meshes."""

    @classmethod
    def poll(cls, context):
        return super().poll(context) and any(o.type == "MESH" for o in context.selected_objects)

    @staticmethod
    def targets(context, world):
        found = []
        for obj in context.selected_objects:
            if obj.type == "MESH":
                placed = world.find(obj)
                if not placed:
                    raise ValueError("%s: has no faces, or is not shown" % obj.name)
                found.append((obj, placed))
        return found


# The modifiers that keep a mesh's own vertices as the first of the new ones.
_KEEP_FIRST = {"SUBSURF", "MULTIRES"}


def _check_elements(obj, placed, domain):
    """How many vertices or corners to ask for. They stand where the modifiers put them."""
    if domain == "CORNER":
        own, made = len(obj.data.loops), len(placed.shape.vertex_of)
    else:
        own, made = len(obj.data.vertices), len(placed.shape.positions)
    if own != made:
        adding = {m.type for m in obj.modifiers if m.show_viewport}
        if domain == "CORNER" or made < own or not adding <= _KEEP_FIRST:
            raise ValueError("%s: its modifiers make %d of %d %s; apply them, or bake to an image" % (
                obj.name, made, own, "corners" if domain == "CORNER" else "vertices"))
    return own


class BakeAttribute(_Bakes, bpy.types.Operator):
    """Bake the visible fraction of each light to colour attributes of the selected meshes"""

    bl_idname = "softshadow.bake_attribute"
    bl_label = "Bake to Color Attributes"

    def prepare(self, context, world, lamps, settings):
        domain = self.domain = settings["domain"]
        targets = self.targets(context, world)
        counts = [_check_elements(obj, placed, domain) for obj, placed in targets]
        self.names = [(obj.name, "Visibility " + lamp.name) for obj, _ in targets for lamp in lamps]
        shown = [placed for _, placed in targets]

        def work(questions, job):
            answers = []
            for n, (placed, count) in enumerate(zip(shown, counts)):
                here = places.of_elements(questions, placed, domain, count)
                answers.extend(questions.ask(here.points, here.normals, here.primitives, n,
                                             len(shown)))
            return answers
        return work

    def finish(self, context, answers):
        for (obj, name), values in zip(self.names, answers):
            results.write_attribute(context.scene.objects[obj].data, name, self.domain, values)
        return "baked %d color attributes" % len(answers)


class BakeImage(_Bakes, bpy.types.Operator):
    """Bake the visible fraction of each light to images by the active UV maps of the selected meshes"""

    bl_idname = "softshadow.bake_image"
    bl_label = "Bake to Images"

    def prepare(self, context, world, lamps, settings):
        size, margin = settings["image_size"], settings["margin"]
        targets = self.targets(context, world)
        for obj, placed in targets:
            if placed.shape.uvs is None:
                raise ValueError("%s: has no UV map" % obj.name)
        self.names = ["Visibility %s %s" % (obj.name, lamp.name)
                      for obj, _ in targets for lamp in lamps]
        shown = [placed for _, placed in targets]

        def work(questions, job):
            answers = []
            for n, placed in enumerate(shown):
                cells, here = places.of_texels(questions, placed, size, job)
                for seen in questions.ask(here.points, here.normals, here.primitives, n,
                                          len(shown)):
                    answers.append(_texels(size, margin, cells, seen))
            return answers
        return work

    def finish(self, context, answers):
        for name, pixels in zip(self.names, answers):
            results.show_image(context, results.write_image(name, pixels))
        return "baked %d images" % len(answers)


def _texels(size, margin, cells, seen):
    """RGBA; transparent beyond the margin."""
    grey, known = numpy.zeros(size * size, numpy.float32), numpy.zeros(size * size, bool)
    grey[cells], known[cells] = seen, True
    grey, known = cover.grow(grey.reshape(size, size), known.reshape(size, size), margin)
    out = results.grey(grey.ravel()).reshape(size, size, 4)
    out[:, :, 3] = known
    return out


class Preview(_Asks, bpy.types.Operator):
    """Draw diffuse surfaces with soft shadows from the scene's camera into an image"""

    bl_idname = "softshadow.preview"
    bl_label = "Render Preview"

    def prepare(self, context, world, lamps, settings):
        camera = preview.Camera(context, context.scene.softshadow)
        return lambda questions, job: preview.draw(questions, world, camera, settings, job)

    def finish(self, context, pixels):
        image = results.write_image("Soft Shadow Preview", pixels)
        results.show_image(context, image)
        return "drawn into the image " + image.name


_classes = (BakeAttribute, BakeImage, Preview)


def register():
    for each in _classes:
        bpy.utils.register_class(each)


def unregister():
    for each in reversed(_classes):
        bpy.utils.unregister_class(each)
