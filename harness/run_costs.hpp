// What the ranks of a run have done and spent. Included by run_model.hpp and window_model.hpp only.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "nscdd/nscdd.hpp"

namespace nscdd::run_detail {

// Least, mean and largest value of one column of rows, one a rank.
inline nlohmann::json over_ranks(std::span<const double> rows, std::size_t columns, std::size_t column) {
    double least = rows[column], sum = 0, largest = least;
    for (std::size_t at = column; at < rows.size(); at += columns) {
        least = std::min(least, rows[at]);
        largest = std::max(largest, rows[at]);
        sum += rows[at];
    }
    return {{"least", least}, {"mean", sum * double(columns) / double(rows.size())}, {"largest", largest}};
}

// What each rank has done and spent. A process speaks through its first rank.
template <class M>
nlohmann::json costs(const Simulation<M>& simulation, double total, double solver_cpu, const Traffic& solving,
                     double iterations) {
    Communicator& comm = simulation.comm();
    const PhaseSeconds& seconds = simulation.seconds();
    const std::array<std::pair<const char*, PhaseTime>, 4> phases{{{"detect", seconds.detect},
                                                                   {"sweep", seconds.sweep},
                                                                   {"interface", seconds.interface},
                                                                   {"advance", seconds.advance}}};
    std::vector<Buffer> mine;  // work, neighbours; 1 for the first rank of a process, then figures of the process
    for (std::size_t k = 0; k < simulation.parts().size(); ++k) {
        mine.push_back({comm.work()[k], double(simulation.parts()[k].peers.size()), double(k == 0), total, solver_cpu,
                        solving.messages, solving.bytes});
        for (const auto& [name, time] : phases)
            mine.back().insert(mine.back().end(), {time.own, time.wait, time.transfer});
    }
    const std::size_t columns = mine[0].size(), first = columns - 3 * phases.size();
    const std::span<const double> all = comm.all_gather(mine);
    Buffer work, processes;
    for (std::size_t at = 0; at < all.size(); at += columns) {
        work.push_back(all[at]);
        if (all[at + 2] > 0) processes.insert(processes.end(), all.begin() + at, all.begin() + at + columns);
    }
    const auto of_processes = [&](std::size_t column) { return over_ranks(processes, columns, column); };
    const auto sum = [&](std::size_t column) {
        double total_of = 0;
        for (std::size_t at = column; at < processes.size(); at += columns) total_of += processes[at];
        return total_of;
    };
    const double count = double(processes.size()) / double(columns), per = iterations > 0 ? 1 / iterations : 0;
    nlohmann::json json = {
        {"work_per_rank", work}, {"neighbours", over_ranks(all, columns, 1)}, {"messages", sum(5)},
        {"bytes", sum(6)},       {"messages_per_iteration", sum(5) * per},    {"bytes_per_iteration", sum(6) * per}};
    double wait = 0, transfer = 0;
    for (std::size_t p = 0; p < phases.size(); ++p) {
        const char* name = phases[p].first;
        const std::size_t at = first + 3 * p;
        json["seconds"][name] = sum(at) / count;
        json["mpi_seconds"][name] = {{"wait", of_processes(at + 1)}, {"transfer", of_processes(at + 2)}};
        wait += sum(at + 1) / count;
        transfer += sum(at + 2) / count;
    }
    json["seconds"]["total"] = of_processes(3)["largest"];
    json["seconds"]["solver_cpu"] = sum(4) / count;
    json["seconds"]["mpi_wait"] = wait;
    json["seconds"]["mpi_transfer"] = transfer;
    json["mpi_fraction"] = sum(3) > 0 ? count * (wait + transfer) / sum(3) : 0;
    return json;
}

// Largest memory that the processes have taken so far: in total, and of one process.
inline nlohmann::json peak_memory(Communicator& comm) {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const double bytes = 1024.0 * static_cast<double>(usage.ru_maxrss);
    const std::span<const double> all = reduce(comm, 1, [bytes](std::size_t k) {
        return k > 0 ? Buffer(2) : Buffer{bytes, bytes};
    });
    return {{"total", all[0]}, {"largest", all[1]}};
}

}  // namespace nscdd::run_detail
