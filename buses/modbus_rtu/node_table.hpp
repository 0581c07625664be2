#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace axisd::modbus_rtu {

/// Something about each node that was heard of, in the order of their addresses. As a map, but what belongs
/// to a node is found without a search, and a new node moves what belongs to the others.
template <class T>
class NodeTable {
 public:
  using value_type = std::pair<std::uint8_t, T>;
  using const_iterator = typename std::vector<value_type>::const_iterator;

  /// nullptr: there is none.
  [[nodiscard]] const T* find(std::uint8_t node) const {
    const auto place = places_.at(node);
    return place == 0 ? nullptr : &entries_.at(place - 1U).second;
  }
  /// Throws std::out_of_range where there is none.
  [[nodiscard]] const T& at(std::uint8_t node) const {
    return entries_.at(places_.at(node) - std::size_t{1}).second;
  }
  /// A new one, if there was none.
  T& operator[](std::uint8_t node) {
    if (places_.at(node) == 0) insert(node);
    return entries_[places_.at(node) - 1U].second;
  }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] const_iterator begin() const { return entries_.begin(); }
  [[nodiscard]] const_iterator end() const { return entries_.end(); }
  [[nodiscard]] auto begin() { return entries_.begin(); }
  [[nodiscard]] auto end() { return entries_.end(); }

 private:
  void insert(std::uint8_t node) {
    const auto behind = std::ranges::upper_bound(entries_, node, {}, &value_type::first);
    entries_.emplace(behind, node, T{});
    for (std::size_t i = 0; i < entries_.size(); ++i)
      places_.at(entries_[i].first) = static_cast<std::uint16_t>(i + 1);
  }

  std::vector<value_type> entries_;
  std::array<std::uint16_t, 256> places_{};  ///< in `entries_`, from 1; 0: none
};

}  // namespace axisd::modbus_rtu
