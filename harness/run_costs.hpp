// What the ranks of a run have done and spent. Included by run_model.hpp and window_model.hpp only.
#pragma once

#include <sys/resource.h>

#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "load.hpp"
#include "nscdd/nscdd.hpp"
#include "over_ranks.hpp"

namespace nscdd::run_detail {

// What this process has sent and spent inside the communicator so far: messages and bytes; then messages, seconds of
// waiting and of transferring, of each operation.
constexpr std::size_t communicated_columns = 2 + 3 * operation_names.size();
inline Buffer communicated(const Communicator& comm) {
    const Traffic traffic = comm.traffic();
    const CommSeconds seconds = comm.seconds();
    Buffer row{traffic.messages, traffic.bytes};
    for (const ByOperation* of : {&traffic.messages_of, &seconds.wait_of, &seconds.transfer_of})
        row.insert(row.end(), of->begin(), of->end());
    return row;
}
// By operation what messages(n) and seconds(n) make of the n-th column of communicated().
inline nlohmann::json by_operation(auto&& messages, auto&& seconds) {
    constexpr std::size_t operations = operation_names.size();
    nlohmann::json json;
    for (std::size_t o = 0; o < operations; ++o)
        json[operation_names[o]] = {{"messages", messages(2 + o)},
                                    {"wait", seconds(2 + operations + o)},
                                    {"transfer", seconds(2 + 2 * operations + o)}};
    return json;
}

// What each rank has done and spent. A process speaks through its first rank. `solving`: of communicated(), while
// contacts were solved.
template <class M>
nlohmann::json costs(const Simulation<M>& simulation, double total, double solver_cpu, const Buffer& solving,
                     double iterations) {
    Communicator& comm = simulation.comm();
    const PhaseSeconds& seconds = simulation.seconds();
    const std::array<std::pair<const char*, PhaseTime>, 4> phases{{{"detect", seconds.detect},
                                                                   {"sweep", seconds.sweep},
                                                                   {"interface", seconds.interface},
                                                                   {"advance", seconds.advance}}};
    // Columns of a rank; `speaks`: 1 for the first rank of a process. Then those of communicated(), and own time, wait,
    // transfer by phase.
    enum : std::size_t { work_done, neighbours, speaks, total_time, cpu_time, messages, bytes };
    constexpr std::size_t first_phase = messages + communicated_columns;
    std::vector<Buffer> mine;
    for (std::size_t k = 0; k < simulation.parts().size(); ++k) {
        mine.push_back({comm.work()[k], double(simulation.parts()[k].peers.size()), double(k == 0), total, solver_cpu});
        mine.back().insert(mine.back().end(), solving.begin(), solving.end());
        for (const auto& [name, time] : phases)
            mine.back().insert(mine.back().end(), {time.own, time.wait, time.transfer});
    }
    const std::size_t columns = mine[0].size();
    const std::span<const double> all = comm.all_gather(mine);
    Buffer work, processes;
    for (std::size_t at = 0; at < all.size(); at += columns) {
        work.push_back(all[at + work_done]);
        if (all[at + speaks] > 0) processes.insert(processes.end(), all.begin() + at, all.begin() + at + columns);
    }
    const auto of_processes = [&](std::size_t column) { return over_ranks(processes, columns, column); };
    const auto sum = [&](std::size_t column) {
        double total_of = 0;
        for (std::size_t at = column; at < processes.size(); at += columns) total_of += processes[at];
        return total_of;
    };
    const double count = double(processes.size()) / double(columns), per = iterations > 0 ? 1 / iterations : 0;
    nlohmann::json json = {{"work_per_rank", work},
                           {"neighbours", over_ranks(all, columns, neighbours)},
                           {"messages", sum(messages)},
                           {"bytes", sum(bytes)},
                           {"messages_per_iteration", sum(messages) * per},
                           {"bytes_per_iteration", sum(bytes) * per},
                           {"operations", by_operation([&](std::size_t c) { return sum(messages + c); },
                                                       [&](std::size_t c) { return of_processes(messages + c); })}};
    double wait = 0, transfer = 0;
    for (std::size_t p = 0; p < phases.size(); ++p) {
        const char* name = phases[p].first;
        const std::size_t at = first_phase + 3 * p;
        json["seconds"][name] = sum(at) / count;
        json["mpi_seconds"][name] = {{"wait", of_processes(at + 1)}, {"transfer", of_processes(at + 2)}};
        wait += sum(at + 1) / count;
        transfer += sum(at + 2) / count;
    }
    json["seconds"]["total"] = of_processes(total_time)["largest"];
    json["seconds"]["solver_cpu"] = sum(cpu_time) / count;
    json["seconds"]["mpi_wait"] = wait;
    json["seconds"]["mpi_transfer"] = transfer;
    json["mpi_fraction"] = sum(total_time) > 0 ? count * (wait + transfer) / sum(total_time) : 0;
    return json;
}

// The key `load` of a result, from the processes of `comm`. Collective.
inline nlohmann::json load_of(const LoadMeter& meter, Communicator& comm, int threads) {
    return load_json(comm.all_gather(std::vector<Buffer>(comm.ranks().size(), meter.row())), threads);
}

struct Memory {  // of processes [bytes]
    double total = 0, most = 0;
    auto summed() { return std::tie(total); }
    auto largest() { return std::tie(most); }
};

// Largest memory that the processes have taken so far: in total, and of one process.
inline nlohmann::json peak_memory(Communicator& comm) {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const double own = 1024.0 * static_cast<double>(usage.ru_maxrss);
    const Memory all = reduce<Memory>(comm, [own](std::size_t k) { return k > 0 ? Memory{} : Memory{own, own}; });
    return {{"total", all.total}, {"largest", all.most}};
}

}  // namespace nscdd::run_detail
