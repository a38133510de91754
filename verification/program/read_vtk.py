"""What VTK's readers, which are ParaView's, find in a .xdmf, .vtp or .vtkhdf: `pvpython read_vtk.py FILE OUT.npz`, or python3 with VTK.

OUT holds, for each reader that is there: `READER/points`, `.../cells`, `.../point/NAME`, `.../cell/NAME`. Exits with 77 where no reader is there."""
import importlib
import sys

import numpy as np

READERS = {
    ".xdmf": (("vtkXdmfReader", "vtkIOXdmf2", {}), ("vtkXdmf3Reader", "vtkIOXdmf3", {}), ("vtkXdmf3Reader", "vtkIOXdmf3", {"SetFileSeriesAsTime": True})),
    ".vtp": (("vtkXMLPolyDataReader", "vtkIOXML", {}),),
    ".vtkhdf": (("vtkHDFReader", "vtkIOHDF", {}),),
}


def readers(ending):
    found = []
    for name, module, settings in READERS[ending]:
        try:
            reader = getattr(importlib.import_module(f"vtkmodules.{module}"), name)()
        except (ImportError, AttributeError):
            continue
        for setting, value in settings.items():
            getattr(reader, setting)(value)
        found.append(("-".join((name, *settings)), reader))
    return found


def arrays(data):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    points = data.GetPoints()
    found = {"points": vtk_to_numpy(points.GetData()) if points and points.GetNumberOfPoints() else np.zeros((0, 3))}
    cells = [data.GetCells()] if data.IsA("vtkUnstructuredGrid") else [data.GetVerts(), data.GetLines(), data.GetPolys()]
    found["cells"] = np.concatenate([vtk_to_numpy(c.GetConnectivityArray()) for c in cells])
    for kind, fields in (("point", data.GetPointData()), ("cell", data.GetCellData())):
        for k in range(fields.GetNumberOfArrays()):
            found[f"{kind}/{fields.GetArrayName(k)}"] = vtk_to_numpy(fields.GetArray(k))
    return found


def main(path, out):
    makers = readers(path[path.rindex(".") :])
    if not makers:
        return 77
    found = {}
    for name, reader in makers:
        reader.SetFileName(path)
        reader.Update()
        for key, values in arrays(reader.GetOutputDataObject(0)).items():
            found[f"{name}/{key}"] = np.array(values)
    np.savez(out, **found)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
