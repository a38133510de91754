# Sourced by the other scripts: how Open MPI is run, and which Python draws the report.
# shellcheck shell=bash

# Tests use more ranks than small machines have cores. Open MPI would refuse to start them, would pin several to one
# core, and would let waiting ranks spin while the rank that they wait for has no core to run on. scripts/main_job undoes
# the last two where every rank has a core.
export OMPI_MCA_rmaps_base_oversubscribe=1
export OMPI_MCA_hwloc_base_binding_policy=none
export OMPI_MCA_mpi_yield_when_idle=1

# mpirun refuses to run as root unless told twice; containers have no other user.
if [[ $(id -u) == 0 ]]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1
    export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi

# Debian's own Python has the modules that scripts/setup installs; another python3 found first on PATH has not.
PYTHON=${NSCDD_PYTHON:-/usr/bin/python3}
export PYTHON
export NSCDD_PYTHON=$PYTHON
