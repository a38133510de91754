// What the ranks of a run have done and spent, gathered. Included by run_model.hpp and window_model.hpp only.
#pragma once

#include <sys/resource.h>

#include <array>
#include <fstream>
#include <string>

#include "files/load.hpp"
#include "model/run_result.hpp"
#include "nscdd/nscdd.hpp"

namespace nscdd::run_detail {

// What this process has sent and spent inside the communicator so far, as communicated_columns says.
inline Buffer communicated(const Communicator& comm) {
    const Communicator::Traffic traffic = comm.traffic();
    const Communicator::Seconds seconds = comm.seconds();
    Buffer row{traffic.messages, traffic.bytes};
    for (const detail::ByOperation* of : {&traffic.messages_of, &seconds.wait_of, &seconds.transfer_of})
        row.insert(row.end(), of->begin(), of->end());
    return row;
}

inline Rows rows_of(std::span<const double> all, std::size_t columns) { return {{all.begin(), all.end()}, columns}; }

// RunResult::costs. `solving`: of communicated(), while contacts were solved. Collective.
template <class M>
Rows gather_costs(const Simulation<M>& simulation, double total, double solver_cpu, const Buffer& solving) {
    Communicator& comm = simulation.comm();
    const PhaseSeconds& seconds = simulation.seconds();
    std::vector<Buffer> mine;
    for (std::size_t k = 0; k < simulation.parts().size(); ++k) {
        Buffer& row = mine.emplace_back();
        row = {comm.meter().swept()[k], double(simulation.parts()[k].neighbours.size()), double(k == 0), total,
               solver_cpu};
        row.insert(row.end(), solving.begin(), solving.end());
        for (const PhaseSeconds::Phase& time : {seconds.detect, seconds.load, seconds.sweep, seconds.test,
                                                seconds.interface, seconds.advance})  // phase_names
            row.insert(row.end(), {time.own, time.wait, time.transfer});
    }
    const std::size_t columns = mine[0].size();
    return rows_of(comm.all_gather(mine), columns);
}

// Rows of load_json() of the processes of `comm`. Collective.
inline Buffer gather_load(const LoadMeter& meter, Communicator& comm) {
    const std::span<const double> all = comm.all_gather(std::vector<Buffer>(comm.ranks().size(), meter.row()));
    return {all.begin(), all.end()};
}

struct Memory {  // of processes [bytes]
    double total = 0, most = 0;
    auto summed() { return std::tie(total); }
    auto largest() { return std::tie(most); }
};

// Most memory of this process so far [bytes]. ru_maxrss is also that of whoever started it, which may have had more.
inline double own_peak_memory() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (double kilobytes = 0; word == "VmHWM:" && status >> kilobytes) return 1024 * kilobytes;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

// Largest memory that the processes have taken so far: in total, and of one process.
inline Memory peak_memory(Communicator& comm) {
    const double own = own_peak_memory();
    return reduce<Memory>(comm, [own](std::size_t k) { return k > 0 ? Memory{} : Memory{own, own}; });
}

}  // namespace nscdd::run_detail
