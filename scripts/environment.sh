# Sourced by the other scripts: how Open MPI is run, which Python draws the report, and how times are shown.
# shellcheck shell=bash

# Tests use more ranks than small machines have cores, which Open MPI would refuse to start. Allowed, it does the rest by
# itself: such ranks are not bound, and yield their core while they wait (its parameter mpi_oversubscribe). Where every rank
# has a core they are bound and spin. What that costs beside other work is in reports/findings/two-cores.md.
export OMPI_MCA_rmaps_base_oversubscribe=1

# Messages up to 64 KiB go through shared memory at once. By default those above 4 KiB wait for their
# receiver, who sweeps. This setting shortens a message of 16 KiB from 4.4 to 0.7 us, and an iteration of 4,000 spheres on two ranks from 49 to 46 us.
export OMPI_MCA_btl_vader_eager_limit=65536
export OMPI_MCA_btl_vader_max_send_size=65536

# OpenBLAS, where it stands for the reference BLAS, starts a thread for each core, and they spin for a while: a run would take
# two cores for 30 ms. SuiteSparse is all that calls it.
export OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}

# mpirun refuses to run as root unless told twice; containers have no other user.
if [[ $(id -u) == 0 ]]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1
    export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi

# Debian's own Python has the modules that scripts/setup installs; another python3 found first on PATH has not.
PYTHON=${NSCDD_PYTHON:-/usr/bin/python3}
export PYTHON
export NSCDD_PYTHON=$PYTHON

clock() { printf '%d:%02d' $(($1 / 60)) $(($1 % 60)); }
