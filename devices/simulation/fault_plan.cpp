#include "devices/simulation/fault_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "devices/simulation/text.hpp"

namespace axisd::simulation {

namespace {

constexpr std::array<std::pair<FaultKind, std::string_view>, 12> kind_names{{
    {FaultKind::drop_request, "drop_request"},
    {FaultKind::corrupt_request, "corrupt_request"},
    {FaultKind::drop_reply, "drop_reply"},
    {FaultKind::delay_reply, "delay_reply"},
    {FaultKind::corrupt_reply, "corrupt_reply"},
    {FaultKind::truncate_reply, "truncate_reply"},
    {FaultKind::echo, "echo"},
    {FaultKind::drip, "drip"},
    {FaultKind::foreign_frame, "foreign_frame"},
    {FaultKind::hang_up, "hang_up"},
    {FaultKind::reboot_before, "reboot_before"},
    {FaultKind::reboot_after, "reboot_after"},
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
  if (number) into = *number;
  return number.has_value();
}

bool set_field(Fault& fault, std::string_view key, std::string_view value) {
  if (key == "node") return take<std::uint8_t>(value, fault.node);
  if (key == "function") return take<std::uint8_t>(value, fault.function);
  if (key == "register") return take<std::uint16_t>(value, fault.register_address);
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

}  // namespace

std::string_view to_string(FaultKind kind) {
  return std::ranges::find(kind_names, kind, &std::pair<FaultKind, std::string_view>::first)->second;
}

std::optional<FaultKind> fault_kind(std::string_view name) {
  const auto found = std::ranges::find(kind_names, name, &std::pair<FaultKind, std::string_view>::second);
  return found == kind_names.end() ? std::nullopt : std::optional(found->first);
}

Result<Fault> parse_fault(std::string_view text) {
  const auto words = split(text, ' ');
  const auto kind = words.empty() ? std::nullopt : fault_kind(words.front());
  if (!kind) {
    std::string known;
    for (const auto& [one, name] : kind_names) known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
    return fail(Reason::invalid_argument, fmt::format("\"{}\" names no fault", text), "use one of " + known);
  }
  Fault fault{.kind = *kind};
  for (const auto word : std::span(words).subspan(1)) {
    const auto [key, value] = key_value(word);
    if (!set_field(fault, key, value))
      return fail(Reason::invalid_argument, fmt::format("\"{}\" is not understood", word),
                  "use node=, function=, register=, count=, skip=, delay_ms= or bytes=HEX");
  }
  return fault;
}

void FaultPlan::add(Fault fault) {
  if (fault.count != 0) faults_.push_back(std::move(fault));
}

std::vector<Fault> FaultPlan::strike(std::span<const std::uint8_t> request) {
  std::vector<Fault> striking;
  for (auto& fault : faults_) {
    if (!matches(fault, request)) continue;
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

}  // namespace axisd::simulation
