#include "api/server/bus_validate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "api/server/convert.hpp"
#include "api/server/parameter_type.hpp"
#include "api/server/serial_format.hpp"
#include "devices/nearest.hpp"

namespace axisd::server {
namespace {

using namespace std::chrono_literals;

// Modbus over serial line 2.2 (addresses), application protocol 6.3 and 6.12 (counts).
constexpr std::uint32_t last_unit = 247;
constexpr std::uint32_t last_register = 65535;
constexpr std::uint32_t last_object = 0xFFFFFF;  // index << 8 | sub-index
constexpr std::size_t longest_object = 256;      // bytes written at once
constexpr std::uint32_t most_read = 125, most_written = 123;
constexpr std::uint32_t lowest_baud = 300, highest_baud = 4'000'000;
constexpr int most_bauds = 16;
constexpr Duration shortest_reply_timeout = 1ms, longest_reply_timeout = 1s;

std::unexpected<Error> outside(std::string message, double minimum, double maximum, std::string unit = {}) {
  return fail({.reason = Reason::out_of_range,
               .message = std::move(message),
               .remedy = "give a value in the permitted range",
               .permitted = Range{minimum, maximum, std::move(unit)}});
}

Result<void> check_bus_named(const std::string& bus) {
  if (!bus.empty()) return {};
  return fail(Reason::invalid_argument, "bus is missing", "name the bus; see ListBuses");
}

Result<void> check_node(std::uint32_t node, std::string_view field) {
  if (node == 0)
    return fail(Reason::invalid_argument, fmt::format("{} is 0", field),
                "node 0 would address every node of the line, which axisd never does");
  if (node > last_unit) return outside(fmt::format("{} {} is out of range", field, node), 1, last_unit);
  return {};
}

template <class List>
bool has_repetition(const List& list) {
  std::vector<typename List::value_type> sorted(list.begin(), list.end());
  std::ranges::sort(sorted);
  return std::ranges::adjacent_find(sorted) != sorted.end();
}

Result<void> check_span(std::uint32_t address, std::uint32_t count, std::uint32_t most) {
  if (count < 1 || count > most) return outside(fmt::format("{} registers in one exchange", count), 1, most);
  if (address > last_register)
    return outside(fmt::format("address {} is out of range", address), 0, last_register);
  if (address + count - 1 > last_register)
    return fail(Reason::invalid_argument,
                fmt::format("{} registers from {} end beyond 65535", count, address),
                "take fewer, or a lower address");
  return {};
}

/// The bytes of a number, in the size of its type.
Result<std::vector<std::uint8_t>> bytes_of(const v1::ObjectNumber& number) {
  const auto type = from_proto(number.type());
  if (!type)
    return fail(Reason::invalid_argument, "type is missing",
                "give the object's own type: it decides how many bytes are written");
  const auto bits = static_cast<int>(8 * size_of(*type));
  const auto lowest = is_signed(*type) ? -(std::int64_t{1} << (bits - 1)) : 0;
  const auto highest = (std::int64_t{1} << (is_signed(*type) ? bits - 1 : bits)) - 1;
  if (number.value() < lowest || number.value() > highest)
    return outside(fmt::format("value {} is out of range", number.value()), double(lowest), double(highest));
  return canopen::number_bytes(static_cast<std::uint64_t>(number.value()), size_of(*type));
}

Result<void> read_serial(const v1::ScanRequest& from, ScanRequest& to) {
  if (from.bauds_size() > most_bauds || has_repetition(from.bauds()) || has_repetition(from.formats()))
    return fail(Reason::invalid_argument, "bauds or formats name one twice, or too many",
                fmt::format("name each once, at most {} bauds", most_bauds));
  for (const auto baud : from.bauds()) {
    if (baud < lowest_baud || baud > highest_baud)
      return outside(fmt::format("baud {} is out of range", baud), lowest_baud, highest_baud, "bit/s");
    to.bauds.push_back(static_cast<int>(baud));
  }
  for (const auto& text : from.formats()) {
    const auto format = parse_format(text);
    if (!format) return fail(format.error());
    to.formats.push_back(*format);
  }
  return {};
}

}  // namespace

Result<TransactRequest> to_transact(const v1::TransactRequest& from) {
  if (auto named = check_bus_named(from.bus()); !named) return fail(std::move(named).error());
  if (auto valid = check_node(from.node(), "node"); !valid) return fail(std::move(valid).error());
  TransactRequest to{.bus = from.bus(), .node = static_cast<std::uint8_t>(from.node())};
  const bool reads = from.operation_case() == v1::TransactRequest::kRead;
  if (!reads && from.operation_case() != v1::TransactRequest::kWrite)
    return fail(Reason::invalid_argument, "neither read nor write is given", "set one of them");
  const auto count = reads ? from.read() : static_cast<std::uint32_t>(from.write().values_size());
  if (auto valid = check_span(from.address(), count, reads ? most_read : most_written); !valid)
    return fail(std::move(valid).error());
  to.address = static_cast<std::uint16_t>(from.address());
  to.count = static_cast<std::uint16_t>(count);
  for (const auto value : from.write().values()) {
    if (value > last_register)
      return outside(fmt::format("value {} is out of range", value), 0, last_register);
    to.values.push_back(static_cast<std::uint16_t>(value));
  }
  return to;
}

bool names_object(const v1::TransactRequest& from) {
  return from.has_read_object() || from.has_write_object();
}

Result<ObjectRequest> to_object_request(const v1::TransactRequest& from) {
  if (auto named = check_bus_named(from.bus()); !named) return fail(std::move(named).error());
  if (!canopen::valid_node(from.node()))
    return outside(fmt::format("node {} is out of range", from.node()), 1, canopen::highest_node);
  if (from.address() > last_object)
    return outside(fmt::format("address {} is out of range", from.address()), 0, last_object);
  ObjectRequest to{
      .bus = from.bus(), .node = static_cast<std::uint8_t>(from.node()), .object = from.address()};
  if (from.has_read_object()) return to;
  const auto& content = from.write_object();
  if (content.has_number()) {
    auto bytes = bytes_of(content.number());
    if (!bytes) return fail(std::move(bytes).error());
    to.bytes = *std::move(bytes);
    return to;
  }
  const auto& data = content.data();
  if (data.empty() || data.size() > longest_object)
    return outside(fmt::format("{} bytes in one transfer", data.size()), 1, double(longest_object));
  to.bytes.assign(data.begin(), data.end());
  return to;
}

Result<ScanRequest> to_scan(const v1::ScanRequest& from) {
  if (auto named = check_bus_named(from.bus()); !named) return fail(std::move(named).error());
  ScanRequest to{.bus = from.bus()};
  // 0 stands for "unset" here: proto3 does not tell them apart, and node 0 is never used.
  const auto first = from.first_node() == 0 ? to.first_node : from.first_node();
  const auto last = from.last_node() == 0 ? std::max<std::uint32_t>(to.last_node, first) : from.last_node();
  if (auto valid = check_node(first, "first_node"); !valid) return fail(std::move(valid).error());
  if (auto valid = check_node(last, "last_node"); !valid) return fail(std::move(valid).error());
  if (first > last)
    return fail(Reason::invalid_argument, fmt::format("first_node {} is above last_node {}", first, last),
                "give them in ascending order");
  to.first_node = static_cast<std::uint8_t>(first);
  to.last_node = static_cast<std::uint8_t>(last);
  if (auto valid = read_serial(from, to); !valid) return fail(std::move(valid).error());
  if (!from.has_reply_timeout()) return to;
  const auto timeout = from_proto(from.reply_timeout());
  if (!timeout || *timeout < shortest_reply_timeout || *timeout > longest_reply_timeout)
    return outside("reply_timeout is out of range", 1, 1000, "ms");
  to.reply_timeout = *timeout;
  return to;
}

Result<void> check_device_write(const v1::WriteDeviceRequest& from, const BusAccess& buses) {
  const auto unknown = [](std::string message, std::string_view text,
                          const std::vector<std::string_view>& names) {
    const auto near = nearest(text, names);
    return fail(Reason::invalid_argument, std::move(message),
                near.empty() ? "ListDevices names all" : fmt::format("did you mean {}?", near));
  };
  const auto devices = buses.devices();
  const auto device = std::ranges::find(devices, from.device(), &DeviceSnapshot::name);
  std::vector<std::string_view> names;
  if (device == devices.end()) {
    for (const auto& known : devices) names.push_back(known->name);
    return unknown(fmt::format("there is no device {:?}", from.device().substr(0, 64)), from.device(), names);
  }
  const auto& values = (*device)->values;
  const auto value = std::ranges::find(values, from.register_(), &DeviceValue::name);
  if (value == values.end()) {
    for (const auto& known : values) names.push_back(known.name);
    return unknown(fmt::format("{} has no value {:?}", from.device(), from.register_().substr(0, 64)),
                   from.register_(), names);
  }
  if (!value->writable)
    return fail(Reason::invalid_argument, fmt::format("{} of {} is read-only", value->name, from.device()),
                "give it 'access: rw' in the configuration if the node permits it");
  if (!from.has_value() || !std::isfinite(from.value()))
    return fail(Reason::invalid_argument, "value is missing or not a finite number", "give a finite number");
  return {};
}

}  // namespace axisd::server
