// One drive of the family on its line.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "buses/modbus_rtu/node.hpp"
#include "devices/canary.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive_access.hpp"
#include "devices/drive_configuration.hpp"
#include "devices/yako_rtu/codec.hpp"
#include "devices/yako_rtu/configuration.hpp"
#include "devices/yako_rtu/mode_watch.hpp"
#include "devices/yako_rtu/model.hpp"
#include "devices/yako_rtu/torn_position.hpp"

namespace axisd::yako_rtu {

/// Thread: core.
///
/// The canary: registers 0x0020..0x0025 live in RAM. Whatever stands there after a power-up is never what
/// this class last wrote, so one read of the block proves that the drive has not been restarted since (M6,
/// M7).
class YakoRtuDrive final : public Drive,
                           public ParametersFacet,
                           public SegmentsFacet,
                           public MemoryFacet,
                           public SerialFacet,
                           public LoadingFacet,
                           public DriftFacet,
                           public RepeatedWatchFacet,
                           public MarksFacet,
                           public ProofFacet,
                           public StopsFacet {
 public:
  YakoRtuDrive(const Model& model, DriveContext context);

  // drive_connection.cpp
  Task<Result<DriveIdentity>> identify(TransactionClass transaction_class) override;
  Task<Result<void>> configure() override;
  using Drive::read_state;
  Task<Result<DriveSample>> read_state(TransactionClass transaction_class, TimePoint awaited_from) override;
  Task<Result<std::optional<DriveSample>>> watch_state(StateWatch watch) override;
  [[nodiscard]] bool moves_by_itself() const override;
  [[nodiscard]] bool closed_loop() const override;
  [[nodiscard]] std::int64_t position_window() const override;

  // drive_configuration.cpp
  Task<Result<Drift>> check_drift(TransactionOptions options) override;

  // drive_motion.cpp
  Task<Result<void>> check_continuity(TransactionClass transaction_class) override;
  [[nodiscard]] std::optional<ContinuityMark> continuity_mark() const override {
    return canary_.is_known() ? std::optional(mark_of(canary_.blocks().front())) : std::nullopt;
  }
  void expect_marks(const std::vector<ContinuityMark>& marks) override {
    canary_.expect(blocks_of(marks));
    proven_at_.reset();
  }
  [[nodiscard]] bool rules_out_restart(const DriveSample& sample) const override;
  [[nodiscard]] std::optional<TimePoint> proven_at() const override { return proven_at_; }
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const MoveProfile& start) const override {
    return marks_until(encode(start));
  }
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const VelocityProfile& start) const override {
    return marks_until(encode(start));
  }
  Task<Result<void>> enable(MotionGuard guard) override;
  Task<Result<void>> disable(MotionGuard guard) override;
  Task<Result<void>> start_move(MoveProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_velocity(VelocityProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_homing(HomingProfile profile, MotionGuard guard) override;
  Task<Result<std::unique_ptr<LoadedMove>>> load_move(MoveProfile profile, MotionGuard guard) override;
  Task<Result<void>> stop(StopKind kind) override;
  Task<Result<void>> repeat_stop() override;
  [[nodiscard]] std::optional<Duration> quick_stop_time(int /*rpm*/) const override { return Duration{}; }
  [[nodiscard]] std::optional<TimePoint> stop_sent_at() const override {
    return node_.bus().stop_sent_at(node_.address());
  }
  Task<Result<void>> clear_alarm(MotionGuard guard) override;
  Task<Result<void>> clear_position(MotionGuard guard) override;

  // drive_parameters.cpp
  [[nodiscard]] std::string configured_by(std::uint32_t address) const override;
  Task<Result<std::vector<ParameterValue>>> read_parameters(std::vector<std::uint32_t> addresses) override;
  Task<Result<std::vector<ParameterValue>>> write_parameters(std::vector<ParameterValue> values) override;
  Task<Result<DriveSegments>> read_segments() override;
  Task<Result<void>> write_segments(DriveSegments segments) override;
  Task<Result<void>> save_parameters() override;
  Task<Result<std::string>> restore_factory(std::vector<std::uint8_t> taken) override;
  Task<Result<std::string>> change_serial(SerialChange change) override;

 private:
  using Answer = modbus_rtu::Answer;
  using Registers = std::map<std::uint16_t, std::uint16_t>;
  struct Trigger {
    std::uint16_t address;
    std::uint16_t value;
  };
  class Loaded;
  class Memory;

  // drive_connection.cpp
  /// One reading of the state, in the order of the readings.
  DriveSample sample_of(std::span<const std::uint16_t> registers, TimePoint asked_at, TimePoint measured_at);
  /// The words of its position may be of two moments: it is read again, at most twice.
  [[nodiscard]] bool is_suspect(std::span<const std::uint16_t> registers, TimePoint measured_at) const;
  Task<Result<DriveSample>> read_again(TransactionClass transaction_class, std::int32_t suspect);
  /// Reads what note_register() keeps: how far from its target the drive takes itself for in position, and
  /// what a start in one frame writes back.
  Task<Result<void>> read_noted();
  void note_register(std::uint16_t address, std::uint16_t value);
  Task<bool> has_register(std::uint16_t address, TransactionClass transaction_class) const;
  [[nodiscard]] Error wrong_model(std::uint16_t code, const std::string& found) const;
  [[nodiscard]] bool readable(std::uint32_t address) const;
  /// Reads what `settings` speak of, in blocks.
  Task<Result<Registers>> read_registers(std::vector<std::uint16_t> addresses,
                                         TransactionOptions options) const;

  // drive_configuration.cpp
  [[nodiscard]] std::unique_ptr<DriveMemory> make_memory();
  [[nodiscard]] MemoryTraits memory_traits() const;

  // drive_motion.cpp
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const MotionBlock& block) const;
  Task<Result<void>> send_stop(StopKind kind, bool patient);
  Task<Result<void>> write_canary(MotionBlock block, TransactionOptions options);
  Task<Result<void>> replace_canary(MotionBlock block);
  Task<Result<Answer>> read_canary(TransactionOptions options);
  bool recognise_canary(std::span<const std::uint16_t> registers);
  /// A block like it that no power-up leaves.
  [[nodiscard]] MotionBlock distinct(const MotionBlock& block) const;
  /// The drive was switched off and on, and came up with `block`.
  void forget_power_cycle(const MotionBlock& block);
  [[nodiscard]] MotionBlock fresh_neutral_block() const;
  [[nodiscard]] Result<void> check_control_mode() const;
  void note_proof(TimePoint asked_at);
  [[nodiscard]] std::optional<TimePoint> fresh_proof() const;
  [[nodiscard]] bool is_started_by_terminals() const;
  [[nodiscard]] bool may_start_in_one_frame() const;
  Task<Result<void>> start(MotionBlock block, std::optional<HomingBlock> homing, Trigger trigger,
                           MotionGuard guard);
  Task<Result<void>> start_once(MotionBlock block, std::optional<HomingBlock> homing, Trigger trigger,
                                MotionGuard guard, std::optional<TimePoint> proven);
  Task<Result<void>> start_in_one_frame(MotionBlock block, Trigger trigger, TransactionOptions options);
  Task<Result<void>> prepare_homing(HomingBlock block, TransactionOptions options);

  // drive_parameters.cpp
  Task<Result<std::vector<ParameterValue>>> read_values(std::vector<std::uint32_t> addresses,
                                                        TransactionOptions options) const;
  [[nodiscard]] Result<std::vector<ParameterValue>> serial_registers(const SerialChange& change) const;
  [[nodiscard]] std::string serial_advice(const SerialChange& change) const;

  [[nodiscard]] std::unexpected<Error> failed(Error error) const;
  /// `found`: in place of the canary.
  [[nodiscard]] Error lost_memory(const MotionBlock& found) const;
  [[nodiscard]] Error error_at(Reason reason, std::uint16_t address, std::string message,
                               std::string remedy) const;

  const Model* model_;
  Clock* clock_;
  modbus_rtu::Node node_;
  DriveSetup setup_;
  std::uint16_t first_input_function_;
  DriveConfiguration configuration_;
  Canary<MotionBlock> canary_{factory_block};
  /// When the canary, or a reading of the state that no restarted drive shows, was asked for, if it was the
  /// last of both. Kept here, and not by the axis: every answer of the drive and every write that voids a
  /// proof passes through this class, and so does the trigger that rests on it.
  std::optional<TimePoint> proven_at_;
  std::optional<bool> found_closed_;  ///< 0x0012 as it was before this power cycle's first write
  std::optional<std::uint16_t> terminal_move_mode_;  ///< 0x0026, if it is known
  ModeWatch mode_;
  TornPosition torn_position_;
  /// 0x011F and the counts of a revolution by 0x0110, as the factory sets them until they were read.
  std::int64_t accuracy_ = 10, counts_per_revolution_ = 4000;
};

std::unique_ptr<Drive> make_drive(const Model& model, DriveContext context);

}  // namespace axisd::yako_rtu
