// What a stop does to the queue of a line on which much waits for others: purge, hasten, queue its frame,
// take it out. The yardstick is the same on an empty queue.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "buses/modbus_rtu/transaction_queue.hpp"

namespace {

using namespace axisd;
using namespace axisd::modbus_rtu;

constexpr std::uint8_t stopped_node = 1;

TransactionPtr make(std::uint8_t node, std::uint16_t address, TransactionClass transaction_class,
                    const std::shared_ptr<AxisGate>& gate) {
  auto transaction = std::make_unique<Transaction>();
  transaction->transaction_class = transaction_class;
  auto& exchange = transaction->exchange;
  exchange.request = {
      .node = node, .function = Function::write_single_register, .address = address, .values = {1}};
  exchange.frame = *encode(exchange.request);
  if (gate) exchange.guard = {.gate = gate, .epoch = gate->epoch()};
  return transaction;
}

/// Median of one stop, in nanoseconds.
double stop_among(int waiting) {
  TransactionQueue queue;
  std::vector<std::shared_ptr<AxisGate>> gates;
  for (int i = 0; i < waiting; ++i) {
    gates.push_back(std::make_shared<AxisGate>());
    queue.push(make(static_cast<std::uint8_t>(2 + i % 120), static_cast<std::uint16_t>(i),
                    TransactionClass::motion, gates.back()));
  }
  const auto own = std::make_shared<AxisGate>();
  constexpr int rounds = 20'001;
  std::vector<double> times;
  times.reserve(rounds);
  for (int round = 0; round < rounds; ++round) {
    queue.push(make(stopped_node, 0x0027, TransactionClass::motion, own));
    auto stop = make(stopped_node, 0x0028, TransactionClass::stop, nullptr);
    const auto begin = monotonic_now();
    own->raise();
    const auto superseded = queue.take_forbidden(*own, begin);
    queue.hasten(stopped_node, TransactionClass::moving_state);
    queue.push(std::move(stop));
    const auto bound = queue.pop();
    const std::chrono::duration<double, std::nano> took = monotonic_now() - begin;
    if (superseded.size() != 1 || bound->transaction_class != TransactionClass::stop) return -1;
    times.push_back(took.count());
  }
  std::ranges::nth_element(times, times.begin() + rounds / 2);
  return times[rounds / 2];
}

}  // namespace

int main() {
  const auto empty = stop_among(0);
  fmt::print("a stop's work on the queue, median\n{:>10} {:>10} {:>8}\n", "waiting", "ns", "ratio");
  for (const int waiting : {0, 10, 100, 1000, 10'000}) {
    const auto took = stop_among(waiting);
    if (took < 0) return 1;
    fmt::print("{:>10} {:>10.0f} {:>8.2f}\n", waiting, took, took / empty);
  }
  return 0;
}
