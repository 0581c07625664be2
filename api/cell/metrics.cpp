#include "api/cell/metrics.hpp"

#include <array>
#include <utility>

namespace axisd::cell {
namespace {

using metrics::Exposition;
using metrics::Labels;
using metrics::MetricType;

constexpr std::array states{std::pair(v1::MACHINE_STATE_PRESENT, std::string_view("present")),
                            std::pair(v1::MACHINE_STATE_SILENT, std::string_view("silent")),
                            std::pair(v1::MACHINE_STATE_UNREGISTERED, std::string_view("unregistered")),
                            std::pair(v1::MACHINE_STATE_GONE, std::string_view("gone"))};

void write_machines(Exposition& to, const Reading& reading) {
  to.family("axisd_cell_machines", MetricType::gauge, "Machines that are known, by state.");
  for (const auto& [state, name] : states)
    to.sample(Labels().with("state", name),
              std::count_if(reading.machines.begin(), reading.machines.end(),
                            [s = state](const auto& machine) { return machine.state == s; }));
  to.family("axisd_cell_machine_up", MetricType::gauge, "1: the axisd of the machine answers this entrance.");
  for (const auto& machine : reading.machines)
    to.sample(Labels().with("machine", machine.name),
              machine.state == v1::MACHINE_STATE_PRESENT || machine.state == v1::MACHINE_STATE_UNREGISTERED
                  ? 1
                  : 0);
  to.family("axisd_cell_machine_registered", MetricType::gauge,
            "1: the machine is registered, or named in the configuration.");
  for (const auto& machine : reading.machines)
    to.sample(
        Labels().with("machine", machine.name),
        machine.state == v1::MACHINE_STATE_PRESENT || machine.state == v1::MACHINE_STATE_SILENT ? 1 : 0);
  to.family("axisd_cell_machine_round_trip_seconds", MetricType::gauge,
            "Of the last question that was answered.");
  for (const auto& machine : reading.machines)
    if (machine.round_trip)
      to.sample(Labels().with("machine", machine.name), metrics::in_seconds(*machine.round_trip));
  to.family("axisd_cell_machine_stop_all", MetricType::gauge,
            "1: StopAll holds the machine, as was last seen.");
  for (const auto& machine : reading.machines)
    to.sample(Labels().with("machine", machine.name), machine.stop_all ? 1 : 0);
}

void write_clocks(Exposition& to, const Reading& reading) {
  to.family("axisd_cell_machine_clock_offset_seconds", MetricType::gauge,
            "The clock of the machine's computer less this one's; each counts since its start.");
  for (const auto& machine : reading.machines)
    if (machine.clock)
      to.sample(Labels().with("machine", machine.name), metrics::in_seconds(machine.clock->offset));
  to.family("axisd_cell_machine_clock_error_seconds", MetricType::gauge,
            "By which the offset of the machine's clock is off at most.");
  for (const auto& machine : reading.machines)
    if (machine.clock)
      to.sample(Labels().with("machine", machine.name), metrics::in_seconds(machine.clock->error));
}

void write_cell(Exposition& to, const Reading& reading) {
  to.family("axisd_cell_info", MetricType::info, "Which entrance this is.");
  to.sample(
      Labels().with("cell", reading.cell).with("machine", reading.machine).with("version", AXISD_VERSION), 1);
  to.family("axisd_cell_degraded", MetricType::gauge,
            "1: etcd does not answer, or this machine is not registered.");
  to.sample({}, reading.registry == v1::REGISTRY_STATE_DEGRADED ? 1 : 0);
  to.family("axisd_cell_registry_age_seconds", MetricType::gauge, "Since etcd was last heard of.");
  if (reading.registry_age) to.sample({}, metrics::in_seconds(*reading.registry_age));
  to.family("axisd_cell_births_total", MetricType::counter, "Machines that began to answer.");
  to.sample({}, reading.lives.births);
  to.family("axisd_cell_deaths_total", MetricType::counter, "Machines that ceased to answer.");
  to.sample({}, reading.lives.deaths);
  to.family("axisd_cell_stop_all", MetricType::gauge, "StopAll of the cell that were not released.");
  to.sample({}, reading.stops_standing);
  to.family("axisd_cell_stop_all_durable", MetricType::gauge, "1: what is known of StopAll is on the disk.");
  to.sample({}, reading.durable ? 1 : 0);
  to.family("axisd_cell_stopped_again_total", MetricType::counter,
            "Machines that came back while StopAll of the cell stood, and were stopped.");
  to.sample({}, reading.told_again);
}

void write_moves(Exposition& to, const Reading& reading) {
  to.family("axisd_cell_group_moves_open", MetricType::gauge,
            "Moves of several machines that this entrance coordinates, or looks at.");
  to.sample({}, reading.open_moves);
  to.family("axisd_cell_group_moves_total", MetricType::counter,
            "Moves of several machines, by how they ended.");
  to.sample(Labels().with("result", "done"), reading.moves.done);
  to.sample(Labels().with("result", "ended_otherwise"), reading.moves.otherwise);
  to.sample(Labels().with("result", "unknown"), reading.moves.unknown);
  to.sample(Labels().with("result", "refused"), reading.moves.refused);
}

void write_calls(Exposition& to, const Reading& reading) {
  to.family("axisd_cell_calls_open", MetricType::gauge, "Calls that are open, streams too.");
  to.sample({}, reading.open_calls);
  to.family("axisd_cell_calls_refused_total", MetricType::counter, "Calls that were not passed on, by why.");
  to.sample(Labels().with("why", "not_permitted"), reading.refused);
  to.sample(Labels().with("why", "too_many"), reading.too_many);
  to.family("axisd_cell_forwarded_calls_total", MetricType::counter,
            "Calls that were passed on, by how they ended.");
  for (const auto& [machine, tally] : reading.tallies) {
    const auto labels = Labels().with("machine", machine);
    to.sample(labels.with("result", "ok"), tally->good.load(std::memory_order_relaxed));
    to.sample(labels.with("result", "error"), tally->failed.load(std::memory_order_relaxed));
    to.sample(labels.with("result", "offline"), tally->refused.load(std::memory_order_relaxed));
  }
  to.family("axisd_cell_forwarded_open", MetricType::gauge, "Calls that are open at a machine.");
  for (const auto& [machine, tally] : reading.tallies)
    to.sample(Labels().with("machine", machine), tally->open.load(std::memory_order_relaxed));
  to.family("axisd_cell_forwarded_bytes_total", MetricType::counter,
            "Bytes of messages that were passed on.");
  for (const auto& [machine, tally] : reading.tallies) {
    const auto labels = Labels().with("machine", machine);
    to.sample(labels.with("direction", "to_machine"), tally->bytes_in.load(std::memory_order_relaxed));
    to.sample(labels.with("direction", "from_machine"), tally->bytes_out.load(std::memory_order_relaxed));
  }
  to.family("axisd_cell_forwarded_seconds", MetricType::histogram,
            "From the arrival of a call to its end, of those with one answer at most.");
  to.histogram({}, reading.durations);
}

void write_certificates(Exposition& to, const Reading& reading) {
  to.family("axisd_cell_certificate_expiry_timestamp_seconds", MetricType::gauge,
            "When the first certificate or list in a file of this entrance ends, in Unix time.");
  for (const auto& file : reading.certificates)
    to.sample(Labels().with("file", file.key),
              std::chrono::duration_cast<std::chrono::seconds>(file.at.time_since_epoch()).count());
}

}  // namespace

std::string render(const Reading& reading, metrics::Format format) {
  Exposition to(format);
  write_cell(to, reading);
  write_machines(to, reading);
  write_clocks(to, reading);
  write_moves(to, reading);
  write_calls(to, reading);
  write_certificates(to, reading);
  return to.take();
}

}  // namespace axisd::cell
