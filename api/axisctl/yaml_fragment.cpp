#include "api/axisctl/yaml_fragment.hpp"

#include <fmt/format.h>

#include "config/models.hpp"

namespace axisd::axisctl {
namespace {

std::string free_name(const v1::FoundNode& node, const FragmentContext& context) {
  auto name = fmt::format("axis-{}", node.node());
  if (context.taken.contains(name)) name = fmt::format("{}-{}", context.bus, name);
  return name;
}

/// One turn per second is a speed that every model and microstep can do; the rest has defaults.
std::string entry(const std::string& name, const v1::FoundNode& node, const FragmentContext& context) {
  return fmt::format(
      "  {}:\n"
      "    bus: {}\n"
      "    node: {}\n"
      "    model: {}\n"
      "    unit: rev\n"
      "    scale: {{ microstep: {} pulses/rev }}\n"
      "    limits: {{ velocity: 1 rev/s }}\n",
      name, context.bus, node.node(), node.model(), node.pulses_per_revolution());
}

/// Of a drive by CiA 402 the data sheet, what a revolution is, and mostly the unit of velocities have to be
/// filled in.
std::string described_entry(const std::string& name, const v1::FoundNode& node,
                            const FragmentContext& context) {
  return fmt::format(
      "  {}:   # {}vendor 0x{:08X}, product 0x{:08X}\n"
      "    bus: {}\n"
      "    node: {}\n"
      "    model: {}\n"
      "    unit: rev\n"
      "    scale: {{ microstep: 4000 pulses/rev }}   # what 6064h counts: see the drive's manual\n"
      "    limits: {{ velocity: 1 rev/s }}\n"
      "    drive:\n"
      "      eds: axis-{}.eds   # the data sheet of the drive, from its maker\n"
      "      # velocity_unit: UNIT   # what 6081h counts, where the data sheet does not tell it\n",
      name, node.note().empty() ? "" : node.note() + ", ", node.vendor(), node.product(), context.bus,
      node.node(), node.model(), node.node());
}

}  // namespace

std::string yaml_fragment(const std::vector<v1::FoundNode>& found, const FragmentContext& context) {
  std::string text;
  std::set<std::uint32_t> used;
  for (const auto& node : found) {
    if (node.model().empty() || !node.configured_as().empty()) continue;
    const auto which = fmt::format("node {} ({}, {} bit/s{}{})", node.node(), node.model(), node.baud(),
                                   node.format().empty() ? "" : ", ", node.format());
    if (node.baud() != context.baud) {
      text += fmt::format("  # {}: set its switches to the bus's {} bit/s\n", which, context.baud);
    } else if (!used.insert(node.node()).second) {
      text += fmt::format("  # {}: a second drive with this address, in another format\n", which);
    } else if (config::is_described_by_file(node.model())) {
      text += described_entry(free_name(node, context), node, context);
    } else if (node.pulses_per_revolution() == 0) {
      text += fmt::format("  # {}: its microstep could not be read, scan again\n", which);
    } else {
      text += entry(free_name(node, context), node, context);
    }
  }
  return text;
}

}  // namespace axisd::axisctl
