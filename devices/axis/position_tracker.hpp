#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "devices/axis/snapshot.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

/// Where an axis stands and how far that can be believed (M19, M20). Pure.
///
/// axis position = scale(unwrapped drive counter + offset). The counter is 32 bit wide and starts at 0 with
/// each power-up; here it is unwrapped to 64 bit. Commanded positions are kept as exact rationals, so that
/// any number of relative moves adds up without drift.
class PositionTracker {
 public:
  explicit PositionTracker(const Scale& scale);
  ~PositionTracker();

  /// A new reading of the drive's counter.
  void update(std::int32_t counter);
  /// The drive restarted: its counter began anew, the old position is void.
  void restart(std::int32_t counter);

  [[nodiscard]] double position() const;
  [[nodiscard]] std::int64_t counter() const { return counter_; }
  [[nodiscard]] std::int64_t offset() const { return offset_; }
  [[nodiscard]] PositionTrust trust() const { return trust_; }
  void lose_trust() { trust_ = PositionTrust::unknown; }

  /// Declares the present counter to be at `position`; the caller journals offset_for() first.
  void set_position(double position, PositionTrust trust);
  [[nodiscard]] std::int64_t offset_for(double position) const;
  /// Takes over a journalled offset after a restart of the daemon.
  void restore(std::int64_t offset);
  /// The drive's counter was cleared at standstill: the position stays what it was.
  void rezero(std::int32_t counter_after);

  struct Exactly;
  struct Target {
    double position;       ///< user units, for people
    std::int64_t counter;  ///< unwrapped drive counter
    std::shared_ptr<const Exactly> exact;
  };
  /// Plans a move. The base of a relative move is the last commanded target at
  /// standstill, or the present position after anything that ended elsewhere. Precondition: finite numbers.
  [[nodiscard]] Target plan_absolute(double position) const;
  [[nodiscard]] Target plan_relative(double distance) const;
  /// How it will be once that target is reached: what is planned behind a move starts from there.
  [[nodiscard]] PositionTracker after(const Target& target) const;
  /// That target was reached and is the base of the next relative move.
  void reached(std::shared_ptr<const Exactly> target);
  /// The axis came to rest elsewhere.
  void forget_target();

 private:
  [[nodiscard]] Target plan(Exactly target) const;

  Scale scale_;
  std::int64_t counter_ = 0;
  bool known_ = false;
  std::int64_t offset_ = 0;
  PositionTrust trust_ = PositionTrust::unknown;
  std::shared_ptr<const Exactly> commanded_;  ///< exact user units
};

}  // namespace axisd
