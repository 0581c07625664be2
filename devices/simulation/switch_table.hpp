// The switches of one simulator as a table: what each means, and the member of its Behaviour that it sets.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

#include "devices/simulation/simulator.hpp"

namespace axisd::simulation {

template <class Behaviour>
struct SwitchEntry {
  SwitchSpec spec;
  bool Behaviour::* member;
};

/// What the simulator exports of its table.
template <class Behaviour, std::size_t size>
consteval std::array<SwitchSpec, size> specs_of(const SwitchEntry<Behaviour> (&entries)[size]) {
  std::array<SwitchSpec, size> all{};
  for (std::size_t i = 0; i < size; ++i) all.at(i) = entries[i].spec;
  return all;
}

/// The defaults, with `switches` flipped as they say. Throws std::invalid_argument for an unknown name.
template <class Behaviour, std::size_t size>
Behaviour behaviour_of(std::string_view model, const SwitchEntry<Behaviour> (&entries)[size],
                       const Switches& switches) {
  Behaviour behaviour{};
  for (const auto& entry : entries) behaviour.*entry.member = entry.spec.default_value;
  for (const auto& [name, on] : switches) {
    const auto* found =
        std::ranges::find_if(entries, [&](const auto& entry) { return entry.spec.name == name; });
    if (found == std::end(entries))
      throw std::invalid_argument(std::string(model) + " has no switch \"" + name + "\"");
    behaviour.*found->member = on;
  }
  return behaviour;
}

}  // namespace axisd::simulation
