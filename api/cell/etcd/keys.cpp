#include "api/cell/etcd/keys.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "api/cell/names.hpp"

namespace axisd::cell::etcd {
namespace {

constexpr std::size_t longest_value = 128 * 1024, most_axes = 1024, longest_text = 128;

}  // namespace

Keys::Keys(std::string_view cell)
    : prefix_(fmt::format("/axisd/{}/", cell)),
      machines_(prefix_ + "machines/"),
      stop_all_(prefix_ + "stop_all") {}

std::string Keys::prefix_end() const {
  auto end = prefix_;
  ++end.back();
  return end;
}

std::optional<std::string> Keys::machine_of(std::string_view key) const {
  if (!key.starts_with(machines_)) return std::nullopt;
  const auto name = key.substr(machines_.size());
  if (!is_machine_name(name)) return std::nullopt;
  return std::string(name);
}

bool is_usable(const kept::Registration& registration) {
  const auto address = [](const std::string& text) { return text.empty() || is_address(text); };
  const auto text = [](const std::string& said) {
    return said.size() <= longest_text &&
           std::ranges::all_of(said, [](char c) { return c >= ' ' && c <= '~'; });
  };
  return is_machine_name(registration.name()) && is_address(registration.axisd_address()) &&
         address(registration.stop_address()) && address(registration.cell_address()) &&
         text(registration.version()) && text(registration.configuration_revision()) &&
         text(registration.machine_id()) && registration.axes_size() <= static_cast<int>(most_axes) &&
         std::ranges::all_of(registration.axes(), [](const auto& axis) { return is_machine_name(axis); });
}

std::optional<kept::Registration> registration_of(std::string_view name, std::string_view value) {
  kept::Registration registration;
  if (value.size() > longest_value ||
      !registration.ParseFromArray(value.data(), static_cast<int>(value.size())) ||
      registration.name() != name || !is_usable(registration))
    return std::nullopt;
  return registration;
}

}  // namespace axisd::cell::etcd
