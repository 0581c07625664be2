#include "tests/bench/index_wire.hpp"

#include <algorithm>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "devices/simulation/simulator.hpp"

namespace axisd::bench {

using namespace std::chrono_literals;
using modbus_rtu::Function;

namespace {

// Manual of the YKD2405PR, 6.1.
constexpr std::uint16_t state = 0x0003, states = 10, moving = 0x0004, counter = 0x000A, microstep = 0x0011;
constexpr std::uint16_t block = 0x0020, trigger_of = 0x0027, stop = 0x0028, enable = 0x0029;
constexpr std::uint16_t absolute_move = 5;
constexpr std::size_t most_kept = 1000;

bool writes(const test::WireEntry& request, std::uint16_t address) {
  const auto first = request.address();
  if (request.function() == 0x06) return first == address;
  return request.is_write() && first <= address && std::size_t{address} < first + request.block().size();
}

}  // namespace

Purpose purpose_of(const test::WireEntry& request) {
  const bool loads = writes(request, block), triggers = writes(request, trigger_of);
  if (loads && triggers) return Purpose::one;
  if (triggers) return Purpose::trigger;
  if (loads) return Purpose::block;
  if (writes(request, stop)) return Purpose::stop;
  if (request.is_write()) return Purpose::other;
  return request.address() == state   ? Purpose::state
         : request.address() == block ? Purpose::canary
                                      : Purpose::other;
}

WireCount::WireCount(test::VirtualLine& line) : line_(&line) {
  line.set_on_bind([this, &line](const test::WireEntry& request) {
    const auto purpose = purpose_of(request);
    ++counts_.at(static_cast<std::size_t>(purpose));
    if (purpose == Purpose::block || purpose == Purpose::one)
      std::ranges::copy_n(request.block().begin(), std::ssize(profile), profile.begin());
    if (on_request) on_request(request, purpose);
    if (line.wire().size() > most_kept) line.forget_wire();  // `request` was in it
  });
}

long WireCount::all() const { return std::accumulate(counts_.begin(), counts_.end(), 0L); }

Duration transaction(test::VirtualLine& line, int baud, std::size_t request_bytes, std::size_t reply_bytes) {
  const modbus_rtu::SerialSettings serial{.baud = baud};
  return modbus_rtu::silence(serial) + modbus_rtu::wire_time(serial, request_bytes) +
         line.network().turnaround() + modbus_rtu::wire_time(serial, reply_bytes);
}
Duration reading(test::VirtualLine& line, int baud) {
  return transaction(line, baud, 8, modbus_rtu::reply_size({.node = 1, .address = state, .count = states}));
}
Duration trigger(test::VirtualLine& line, int baud) { return transaction(line, baud, 8, 8); }

RawScript::RawScript(const Settings& settings)
    : settings_(settings), line_(world_, {.name = "line", .port = "sim", .baud = settings.baud}) {
  line_.start([this](std::span<const modbus_rtu::ExchangeResult> results) { result_ = results.back(); },
              [](const PortStatus&) {});
  for (int node = 1; node <= settings.drives; ++node) {
    drives_.push_back({.node = static_cast<std::uint8_t>(node)});
    line_.network().add(simulation::find_simulator("ykd2405pr")->make({.address = drives_.back().node}));
  }
  line_.network().advance(world_.now());
  world_.run_for(1s);  // the drives have booted
  for (auto& drive : drives_) {
    write(drive.node, microstep, {settings.microstep});
    write(drive.node, enable, {1});
  }
}

std::vector<std::uint16_t> RawScript::ask(modbus_rtu::Request request) {
  auto frame = modbus_rtu::encode(request);
  if (!frame) throw std::runtime_error(to_string(frame.error()));
  exchange_ = {.request = std::move(request), .reply_timeout = 500ms, .frame = *frame};
  result_.reset();
  line_.arm(exchange_);
  world_.run_until([this] { return result_.has_value(); }, 2s);
  if (!result_ || result_->status != modbus_rtu::ExchangeStatus::replied ||
      result_->reply.kind != modbus_rtu::ReplyKind::match)
    throw std::runtime_error("a drive does not answer the raw script: " +
                             modbus_rtu::to_hex(exchange_.frame.bytes()));
  return result_->registers();
}

void RawScript::write(std::uint8_t node, std::uint16_t address, std::vector<std::uint16_t> values) {
  const auto count = static_cast<std::uint16_t>(values.size());
  ask({.node = node,
       .function = count == 1 ? Function::write_single_register : Function::write_multiple_registers,
       .address = address,
       .count = count,
       .values = std::move(values)});
}

void RawScript::start(Drive& drive) {
  drive.target = drive.target == settings_.here ? settings_.there : settings_.here;
  drive.moves = true;
  const auto target = static_cast<std::uint32_t>(drive.target);
  std::vector<std::uint16_t> values(settings_.profile.begin(), settings_.profile.end());
  values.push_back(static_cast<std::uint16_t>(target >> 16U));
  values.push_back(static_cast<std::uint16_t>(target & 0xFFFFU));
  if (settings_.start == Start::one) {
    values.insert(values.end(), {0, absolute_move});  // 0x0026 between them is for terminals
    return write(drive.node, block, std::move(values));
  }
  write(drive.node, block, std::move(values));
  write(drive.node, trigger_of, {absolute_move});
}

/// Each drive once; how many of them were started.
long RawScript::lap() {
  long started = 0;
  for (auto& drive : drives_) {
    if (drive.moves) {
      const auto values = ask({.node = drive.node, .address = state, .count = states});
      const auto at = static_cast<std::int32_t>(std::uint32_t{values.at(counter - state)} << 16U |
                                                values.at(counter + 1 - state));
      drive.moves = values.at(moving - state) != 0 || at != drive.target;
    }
    if (drive.moves) continue;
    start(drive);
    ++started;
  }
  return started;
}

double RawScript::rate(long moves) {
  constexpr int laps_before = 10;
  constexpr long longest_lull = 1000;  // laps without a move
  for (int i = 0; i < laps_before; ++i) lap();
  const auto begin = world_.now();
  long started = 0;
  for (long laps = 0; started < moves; ++laps) {
    started += lap();
    if (laps > longest_lull * moves) throw std::runtime_error("the drives of the raw script do not move");
  }
  return static_cast<double>(started) / std::chrono::duration<double>(world_.now() - begin).count();
}

}  // namespace axisd::bench
