#include "devices/simulation/fault_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "devices/simulation/text.hpp"

namespace axisd::simulation {

namespace {

enum Wire : unsigned { on_rtu = 1, on_can = 2 };

struct KindName {
  FaultKind kind;
  std::string_view name;
  unsigned wires;  ///< where it can be
};
constexpr std::array<KindName, 21> kind_names{{
    {FaultKind::drop_request, "drop_request", on_rtu | on_can},
    {FaultKind::corrupt_request, "corrupt_request", on_rtu},
    {FaultKind::drop_reply, "drop_reply", on_rtu | on_can},
    {FaultKind::delay_reply, "delay_reply", on_rtu | on_can},
    {FaultKind::corrupt_reply, "corrupt_reply", on_rtu},
    {FaultKind::truncate_reply, "truncate_reply", on_rtu},
    {FaultKind::echo, "echo", on_rtu},
    {FaultKind::drip, "drip", on_rtu},
    {FaultKind::duplicate_request, "duplicate_request", on_rtu},
    {FaultKind::duplicate_reply, "duplicate_reply", on_rtu},
    {FaultKind::foreign_frame, "foreign_frame", on_rtu},
    {FaultKind::hang_up, "hang_up", on_rtu},
    {FaultKind::reboot_before, "reboot_before", on_rtu | on_can},
    {FaultKind::reboot_after, "reboot_after", on_rtu | on_can},
    {FaultKind::abort, "abort", on_can},
    {FaultKind::wrong_toggle, "wrong_toggle", on_can},
    {FaultKind::endless_upload, "endless_upload", on_can},
    {FaultKind::silence, "silence", on_can},
    {FaultKind::flood, "flood", on_can},
    {FaultKind::emcy, "emcy", on_can},
    {FaultKind::reboot, "reboot", on_can},
}};

/// Registers that a request names: first and number. Nothing for functions without registers.
std::optional<std::pair<int, int>> registers_of(std::span<const std::uint8_t> request) {
  if (request.size() < 8) return std::nullopt;
  const int first = request[2] << 8 | request[3];
  if (request[1] == 0x06) return std::pair{first, 1};
  if (request[1] == 0x03 || request[1] == 0x10) return std::pair{first, request[4] << 8 | request[5]};
  return std::nullopt;
}

bool matches(const Fault& fault, std::span<const std::uint8_t> request) {
  if (fault.node && *fault.node != request[0]) return false;
  if (fault.function && *fault.function != request[1]) return false;
  if (!fault.register_address) return true;
  const auto registers = registers_of(request);
  return registers && *fault.register_address >= registers->first &&
         *fault.register_address < registers->first + registers->second;
}

bool is_sdo_request(const can::Frame& frame) {
  return frame.id > 0x600 && frame.id <= 0x67F && frame.size == 8;
}

/// Meant for `node` in the predefined connection set.
bool concerns(std::uint8_t node, const can::Frame& frame) {
  if (frame.extended || frame.rtr) return false;
  if (frame.id == 0) return frame.size >= 2 && (frame.data[1] == 0 || frame.data[1] == node);
  if (frame.id == 0x80) return true;
  const auto function = frame.id & 0x780U;
  const bool is_rpdo = function >= 0x200 && function <= 0x500 && (function & 0x80U) == 0;
  return (is_rpdo || function == 0x600) && (frame.id & 0x7FU) == node;
}

bool matches(const Fault& fault, std::uint8_t node, const can::Frame& frame) {
  if (fault.node && *fault.node != node) return false;
  // Of these, `cob` is what they send.
  if (fault.cob && fault.kind != FaultKind::flood && fault.kind != FaultKind::emcy && *fault.cob != frame.id)
    return false;
  const bool about_sdo = fault.kind == FaultKind::abort || fault.kind == FaultKind::drop_reply ||
                         fault.kind == FaultKind::delay_reply;
  const bool about_upload = fault.kind == FaultKind::wrong_toggle || fault.kind == FaultKind::endless_upload;
  if ((about_sdo || about_upload || fault.object) && !is_sdo_request(frame)) return false;
  const auto command = static_cast<unsigned>(frame.data[0] >> 5U);
  if (about_upload && command != 2) return false;
  // What goes on names no object, and an abort is no request.
  if (fault.object && command != 1 && command != 2) return false;
  if (about_sdo && command == 4) return false;
  return !fault.object || *fault.object == (frame.data[1] | frame.data[2] << 8U);
}

std::optional<std::vector<std::uint8_t>> parse_hex(std::string_view text) {
  if (text.empty() || text.size() % 2 != 0) return std::nullopt;
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = 0; at < text.size(); at += 2) {
    std::uint8_t byte = 0;
    const auto* end = text.data() + at + 2;
    const auto parsed = std::from_chars(text.data() + at, end, byte, 16);
    if (parsed.ec != std::errc{} || parsed.ptr != end) return std::nullopt;
    bytes.push_back(byte);
  }
  return bytes;
}

/// Stores `value` in `into`; false if it is no number of that type.
template <class Integer, class Target>
bool take(std::string_view value, Target& into) {
  const auto number = parse_number<Integer>(value);
  if (!number) return false;
  const Integer known = *number;
  into = known;
  return true;
}

bool set_field(Fault& fault, Wire wire, std::string_view key, std::string_view value) {
  if (key == "node") return take<std::uint8_t>(value, fault.node);
  if (key == "function" && wire == on_rtu) return take<std::uint8_t>(value, fault.function);
  if (key == "register" && wire == on_rtu) return take<std::uint16_t>(value, fault.register_address);
  if (key == "cob" && wire == on_can) return take<std::uint16_t>(value, fault.cob) && *fault.cob <= 0x7FF;
  if (key == "object" && wire == on_can) return take<std::uint16_t>(value, fault.object);
  if (key == "code" && wire == on_can) return take<std::uint32_t>(value, fault.code);
  if (key == "count") return take<int>(value, fault.count);
  if (key == "skip") return take<int>(value, fault.skip);
  if (key == "delay_ms") {
    const auto delay = parse_number<std::uint32_t>(value);
    if (delay) fault.delay = std::chrono::milliseconds(*delay);
    return delay.has_value();
  }
  if (key != "bytes") return false;
  auto bytes = parse_hex(value);
  if (bytes) fault.bytes = std::move(*bytes);
  return bytes.has_value();
}

Result<Fault> parse(std::string_view text, Wire wire) {
  const auto words = split(text, ' ');
  const auto kind = words.empty() ? std::nullopt : fault_kind(words.front());
  const auto usable = [&](const KindName& one) { return (one.wires & wire) != 0; };
  if (!kind || !usable(*std::ranges::find(kind_names, *kind, &KindName::kind))) {
    std::string known;
    for (const auto& one : kind_names)
      if (usable(one)) known += fmt::format("{}{}", known.empty() ? "" : ", ", one.name);
    return fail(Reason::invalid_argument, fmt::format("\"{}\" names no fault", text), "use one of " + known);
  }
  Fault fault{.kind = *kind};
  for (const auto word : std::span(words).subspan(1)) {
    const auto [key, value] = key_value(word);
    if (!set_field(fault, wire, key, value))
      return fail(Reason::invalid_argument, fmt::format("\"{}\" is not understood", word),
                  wire == on_rtu ? "use node=, function=, register=, count=, skip=, delay_ms= or bytes=HEX"
                                 : "use node=, cob=, object=, code=, count=, skip=, delay_ms= or bytes=HEX");
  }
  return fault;
}

}  // namespace

std::string_view to_string(FaultKind kind) {
  return std::ranges::find(kind_names, kind, &KindName::kind)->name;
}

std::optional<FaultKind> fault_kind(std::string_view name) {
  const auto* const found = std::ranges::find(kind_names, name, &KindName::name);
  return found == kind_names.end() ? std::nullopt : std::optional(found->kind);
}

bool Fault::strikes_at_once() const {
  const bool by_itself = kind == FaultKind::silence || kind == FaultKind::flood || kind == FaultKind::emcy ||
                         kind == FaultKind::reboot;
  const bool sends = kind == FaultKind::flood || kind == FaultKind::emcy;  // `cob` is what it sends
  return by_itself && !object && skip == 0 && (sends || !cob);
}

Result<Fault> parse_fault(std::string_view text) { return parse(text, on_rtu); }
Result<Fault> parse_can_fault(std::string_view text) { return parse(text, on_can); }

void FaultPlan::add(Fault fault) {
  if (fault.count != 0) faults_.push_back(std::move(fault));
}

template <class Matches>
std::vector<Fault> FaultPlan::strike_if(Matches matches) {
  std::vector<Fault> striking;
  for (auto& fault : faults_) {
    if (!matches(fault)) continue;
    if (fault.skip > 0) {
      --fault.skip;
      continue;
    }
    striking.push_back(fault);
    if (fault.count > 0) --fault.count;
  }
  std::erase_if(faults_, [](const Fault& fault) { return fault.count == 0; });
  return striking;
}

std::vector<Fault> FaultPlan::strike(std::span<const std::uint8_t> request) {
  return strike_if([&](const Fault& fault) { return matches(fault, request); });
}

std::vector<Fault> FaultPlan::strike(std::uint8_t node, const can::Frame& frame) {
  if (faults_.empty() || !concerns(node, frame)) return {};
  return strike_if([&](const Fault& fault) { return matches(fault, node, frame); });
}

}  // namespace axisd::simulation
