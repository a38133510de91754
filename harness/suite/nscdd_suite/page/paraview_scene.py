"""Spheres, force chains and walls of frames in ParaView: `pvpython paraview_scene.py FRAMES.pvd OUT.png [COLOUR [NUMBER]]`.

In ParaView itself: Tools, Python Shell, Run Script; it asks for nothing where FRAMES is set in the shell before."""
import os
import sys

from paraview.simple import *  # noqa: F403  as ParaView's own scripts do


def show(frames, colour="speed"):
    """Shows the three parts of the frames in the active view; returns it."""
    stem, view = frames[: -len(".pvd")], GetActiveViewOrCreate("RenderView")
    grains, contacts, walls = (OpenDataFile(os.path.abspath(name)) for name in (frames, stem + ".contacts.pvd", stem + ".walls.pvd"))
    spheres = Glyph(Input=grains, GlyphType="Sphere")
    spheres.OrientationArray, spheres.ScaleArray, spheres.ScaleFactor, spheres.GlyphMode = (
        ["POINTS", "No orientation array"],
        ["POINTS", "radius"],
        2,
        "All Points",
    )
    shown = Show(spheres, view)
    ColorBy(shown, ("POINTS", *{"speed": ("velocity", "Magnitude"), "spin": ("spin", "Magnitude")}.get(colour, (colour,))))
    shown.Opacity = 0.35
    tubes = Tube(Input=contacts, Scalars=["POINTS", "radius"], VaryRadius="By Absolute Scalar")
    shown = Show(tubes, view)
    shown.ColorArrayName = ["POINTS", ""]
    shown.AmbientColor = shown.DiffuseColor = [0.76, 0.24, 0.17]
    shown = Show(walls, view)
    shown.Representation = "Wireframe"
    shown.AmbientColor = shown.DiffuseColor = [0.3, 0.3, 0.3]
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    return view


def main(frames, out, colour="speed", number="-1"):
    view = show(frames, colour)
    times = GetTimeKeeper().TimestepValues
    times = list(times) if hasattr(times, "__len__") else [times]
    view.ViewTime = times[int(number)]
    ResetCamera(view)
    Render(view)
    view.OrientationAxesVisibility = 0
    SaveScreenshot(out, view, ImageResolution=[1200, 1000])


if __name__ == "__main__":
    main(*sys.argv[1:])
