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
///
/// A relative move starts from its base: the target that was reached last, for as long as the shaft stays
/// there; else the position that is measured.
class PositionTracker {
 public:
  explicit PositionTracker(const Scale& scale);
  ~PositionTracker();

  /// A new reading of the drive's counter. A base that lies further away than `window` pulses is void: the
  /// shaft was moved. The window is 0 for a counted position, else the drive's in-position window.
  void update(std::int32_t counter, std::int64_t window = 0);
  /// The drive restarted: its counter began anew, the old position is void.
  void restart(std::int32_t counter);

  [[nodiscard]] double position() const;
  [[nodiscard]] std::int64_t counter() const { return counter_; }
  /// Where the drive was told to stand, if the shaft rests there; else as counter().
  [[nodiscard]] std::int64_t resting_counter() const { return base_ ? base_->counter : counter_; }
  [[nodiscard]] std::int64_t offset() const { return offset_; }
  [[nodiscard]] PositionTrust trust() const { return trust_; }
  void lose_trust() { trust_ = PositionTrust::unknown; }

  /// Declares the present counter to be at `position`; the caller journals offset_for() first.
  void set_position(double position, PositionTrust trust) { declare(offset_for(position), trust); }
  /// The same with the offset that was journalled: a measured counter may have wavered since.
  void declare(std::int64_t offset, PositionTrust trust);
  [[nodiscard]] std::int64_t offset_for(double position) const;
  /// Takes over a journalled offset after a restart of the daemon.
  void restore(std::int64_t offset);
  /// The drive's counter was cleared at standstill: the position stays what it was, and so does the base.
  void rezero(std::int32_t counter_after);

  struct Exactly;
  struct Target {
    double position = 0;       ///< user units, for people
    std::int64_t counter = 0;  ///< unwrapped drive counter
    std::shared_ptr<const Exactly> exact{};
    std::shared_ptr<const Exactly> distance{};  ///< of a relative move, as asked; user units
  };
  /// Plans a move. Precondition: finite numbers.
  [[nodiscard]] Target plan_absolute(double position) const;
  [[nodiscard]] Target plan_relative(double distance) const;
  /// The same move, by what is known at this moment: the counter may mean something else by now, and the
  /// shaft stand elsewhere.
  [[nodiscard]] Target again(const Target& target) const;
  /// Where there is no base, the position that was measured last becomes it.
  void settle_base();
  /// The drive was told to go there, and rests there.
  [[nodiscard]] bool rests_at(const Target& target) const;
  /// Pulses by which the way to `target` differs from the distance that was asked for; 0 for an absolute one.
  [[nodiscard]] std::int64_t deviation(const Target& target) const;
  /// How it will be once that target is reached: what is planned behind a move starts from there.
  [[nodiscard]] PositionTracker after(const Target& target) const;
  /// The drive came to rest after it was told to go to that target: the base of the next relative move, if
  /// the shaft is within `window` pulses of it.
  void reached(const Target& target, std::int64_t window = 0);
  /// The shaft moves, or nothing holds it where it stands.
  void forget_base() { base_.reset(); }

 private:
  struct Base {
    std::shared_ptr<const Exactly> units;
    std::int64_t counter = 0;  ///< what the drive was told; measured where it was told nothing
  };
  [[nodiscard]] Target plan(Exactly target) const;

  Scale scale_;
  std::int64_t counter_ = 0;
  bool known_ = false;
  std::int64_t offset_ = 0;
  PositionTrust trust_ = PositionTrust::unknown;
  std::optional<Base> base_;
};

}  // namespace axisd
