// Which answers of one node may still come though nobody waits for them.
#pragma once

#include <map>
#include <optional>

#include "buses/canopen/object.hpp"
#include "buses/clock.hpp"

namespace axisd::canopen {

/// Keeps late replies from answering another request. Pure. Thread: core.
///
/// A reply that opens a transfer, and every abort, names its object; segments do not, but cannot be taken for
/// an opening. A node answers in order. So a late reply can only be mistaken for the answer to a request of
/// the same object, and once any other request was answered nothing older can follow. An abort sent at a
/// timeout frees the server, but is not answered itself and proves nothing.
class LateReplies {
 public:
  /// So long after its time a reply may still come (drives that save to their EEPROM, slow gateways).
  static constexpr auto latest = std::chrono::seconds(5);

  void expect(Object object, TimePoint now) {
    until_[object] = now + latest;
    ++outstanding_;
  }
  /// The answer to a request whose object was not expected late came, or the node booted.
  void forget() {
    until_.clear();
    outstanding_ = 0;
  }
  /// A reply came that nobody waits for. False: none can be late; another node sent it.
  [[nodiscard]] bool explain() {
    if (outstanding_ == 0) return false;
    --outstanding_;
    return true;
  }
  [[nodiscard]] bool may_come(Object object, TimePoint now) const {
    const auto found = until_.find(object);
    return found != until_.end() && found->second >= now;
  }
  /// An object that any node answers for (be it by an abort) and that is not expected late: reading it brings
  /// both sides in step. None: too many were tried within `latest`.
  [[nodiscard]] std::optional<Object> probe(TimePoint now) const;

 private:
  std::map<Object, TimePoint> until_;
  int outstanding_ = 0;
};

}  // namespace axisd::canopen
