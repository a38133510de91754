"""What VTK's readers of XDMF, which are ParaView's, find in a file: `pvpython read_xdmf.py FILE OUT.npz`, or python3 with VTK.

OUT holds, for each reader that is there: `READER/times` and, by step k and block, `READER/k/BLOCK/points`, `.../cells`,
`.../point/NAME`, `.../cell/NAME`. Exits with 77 where no reader is there."""
import importlib
import sys

import numpy as np


def readers():
    found = {}
    for name, module in (("vtkXdmfReader", "vtkIOXdmf2"), ("vtkXdmf3Reader", "vtkIOXdmf3")):
        try:
            found[name] = getattr(importlib.import_module(f"vtkmodules.{module}"), name)
        except (ImportError, AttributeError):
            pass
    return found


def blocks(data, name="all"):
    """(name, data set) of each leaf of a composite data set."""
    if not data.IsA("vtkMultiBlockDataSet"):
        return [(name, data)]
    leaves = []
    for k in range(data.GetNumberOfBlocks()):
        if data.GetBlock(k) is not None:
            key = data.GetMetaData(k).Get(data.NAME()) if data.HasMetaData(k) else None
            leaves += blocks(data.GetBlock(k), key or f"block {k}")
    return leaves


def arrays(data):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    found = {"points": vtk_to_numpy(data.GetPoints().GetData())}
    cells = data.GetCells() if hasattr(data, "GetCells") else data.GetLines()
    found["cells"] = vtk_to_numpy(cells.GetConnectivityArray())
    for kind, fields in (("point", data.GetPointData()), ("cell", data.GetCellData())):
        for k in range(fields.GetNumberOfArrays()):
            found[f"{kind}/{fields.GetArrayName(k)}"] = vtk_to_numpy(fields.GetArray(k))
    return found


def main(path, out):
    makers = readers()
    if not makers:
        return 77
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as pipeline

    found = {}
    for name, make in makers.items():
        reader = make()
        reader.SetFileName(path)
        reader.UpdateInformation()
        information = reader.GetOutputInformation(0)
        times = information.Get(pipeline.TIME_STEPS()) if information.Has(pipeline.TIME_STEPS()) else ()
        found[f"{name}/times"] = np.array(times)
        for k, time in enumerate(times or (None,)):
            reader.Update() if time is None else reader.UpdateTimeStep(time)
            for block, data in blocks(reader.GetOutputDataObject(0)):
                for key, values in arrays(data).items():
                    found[f"{name}/{k}/{block}/{key}"] = np.array(values)
    np.savez(out, **found)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
