// One CiA 402 drive on its CANopen network.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/canopen/pdo_configuration.hpp"
#include "buses/signal.hpp"
#include "devices/cia402/configuration.hpp"
#include "devices/cia402/encoding.hpp"
#include "devices/cia402/foreign_master.hpp"
#include "devices/cia402/homing_run.hpp"
#include "devices/cia402/known_words.hpp"
#include "devices/cia402/model.hpp"
#include "devices/cia402/motion_watch.hpp"
#include "devices/cia402/node_contact.hpp"
#include "devices/cia402/object_canary.hpp"
#include "devices/cia402/objects.hpp"
#include "devices/cia402/seen_objects.hpp"
#include "devices/cia402/start_pdo.hpp"
#include "devices/cia402/state_link.hpp"
#include "devices/cia402/status_word.hpp"
#include "devices/cia402/stops_sent.hpp"
#include "devices/cia402/unit_objects.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"
#include "devices/drive_configuration.hpp"

namespace axisd::cia402 {

/// Thread: core.
///
/// The canary: 607Ah, 6081h, 6083h, 6084h and the start speed live in RAM. What stands there after a power-up
/// is never what this class last wrote, so reading them proves that the drive has not been restarted since
/// (M6, M7), beside boot-up message and heartbeat.
///
/// Power never moves (M23). In Operation Enabled a drive of this family rests in one of two ways: ready
/// (control word 0Fh, no motion under way), or halted (10Fh) after a stop. A halt is only ever released with
/// nothing behind it: see make_ready().
class Cia402Drive final : public Drive,
                          public ParametersFacet,
                          public MemoryFacet,
                          public SerialFacet,
                          public LoadingFacet,
                          public CommonStartFacet,
                          public DriftFacet,
                          public MarksFacet,
                          public NewsFacet,
                          public StopsFacet {
 public:
  Cia402Drive(const Model& model, DriveContext context);
  ~Cia402Drive() override;
  Cia402Drive(const Cia402Drive&) = delete;

  // drive_connection.cpp
  Task<Result<DriveIdentity>> identify(TransactionClass transaction_class) override;
  Task<Result<void>> configure() override;
  [[nodiscard]] bool closed_loop() const override;
  [[nodiscard]] std::int64_t position_window() const override;

  // drive_state.cpp
  using Drive::read_state;
  Task<Result<DriveSample>> read_state(TransactionClass transaction_class, TimePoint awaited_from) override;
  [[nodiscard]] std::string link_note() const override;
  void on_attention(const std::function<void()>& handler) override { attention_ = handler; }

  [[nodiscard]] bool in_trouble() const override { return contact_.rebooted() || contact_.has_alarm(); }

  // drive_canary.cpp
  Task<Result<void>> check_continuity(TransactionClass transaction_class) override;
  [[nodiscard]] std::optional<ContinuityMark> continuity_mark() const override { return canary_.mark(); }
  void expect_marks(const std::vector<ContinuityMark>& marks) override { canary_.expect_marks(marks); }
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const MoveProfile& start) const override;
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const VelocityProfile& start) const override;

  // drive_power.cpp
  Task<Result<void>> enable(MotionGuard guard) override;
  Task<Result<void>> disable(MotionGuard guard) override;
  Task<Result<void>> clear_alarm(MotionGuard guard) override;

  // drive_stop.cpp
  Task<Result<void>> stop(StopKind kind) override;
  [[nodiscard]] std::optional<TimePoint> stop_sent_at() const override { return stops_.frame_at(); }
  Task<Result<void>> repeat_stop() override { return stop(StopKind::stop); }
  [[nodiscard]] std::optional<Duration> quick_stop_time(int rpm) const override;

  // drive_motion.cpp
  Task<Result<void>> start_move(MoveProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_velocity(VelocityProfile profile, MotionGuard guard) override;
  Task<Result<void>> start_homing(HomingProfile profile, MotionGuard guard) override;
  Task<Result<void>> clear_position(MotionGuard guard) override;

  // drive_group_start.cpp
  [[nodiscard]] std::string_view no_common_start() const override { return start_pdo_.note(); }
  Task<Result<std::unique_ptr<PreparedMove>>> prepare_move(MoveProfile profile, MotionGuard guard) override;
  Task<Result<std::unique_ptr<LoadedMove>>> load_move(MoveProfile profile, MotionGuard guard) override;

  // drive_configuration.cpp
  Task<Result<Drift>> check_drift(TransactionOptions options) override;

  // drive_parameters.cpp
  [[nodiscard]] std::string configured_by(std::uint32_t address) const override;
  Task<Result<std::vector<ParameterValue>>> read_parameters(std::vector<std::uint32_t> addresses) override;
  Task<Result<std::vector<ParameterValue>>> write_parameters(std::vector<ParameterValue> values) override;
  Task<Result<void>> save_parameters() override;
  Task<Result<std::string>> restore_factory(std::vector<std::uint8_t> taken) override;
  Task<Result<std::string>> change_serial(SerialChange change) override;

 private:
  using Object = canopen::Object;
  using SdoOptions = canopen::SdoOptions;
  class Prepared;
  class Loaded;
  class Memory;
  struct Trigger {
    Object object;
    std::int64_t value = 0;
  };
  // drive_access.cpp
  /// The object's value, with its sign where its type has one. Learns the object's size.
  Task<Result<std::int64_t>> read_object(Object object, SdoOptions options);
  /// Writes the object in the size that this drive takes: as it was seen to take it, else `bytes`, or the
  /// dictionary's if that is 0; after an abort 0607001xh in the size that the drive reports, or another one.
  Task<Result<void>> write_object(Object object, std::int64_t value, std::uint8_t bytes, SdoOptions options);
  /// The same, and reads it back. misconfigured: it holds something else.
  Task<Result<void>> write_verified(Object object, std::int64_t value, SdoOptions options);
  /// Reads `object` until `fits`, or `limit` is over: the last value.
  Task<Result<std::int64_t>> read_until(Object object, std::function<bool(std::int64_t)> fits, Duration limit,
                                        SdoOptions options);
  [[nodiscard]] std::unexpected<Error> failed(Error error) const;
  [[nodiscard]] Error error_at(Reason reason, Object object, std::string message, std::string remedy) const;
  [[nodiscard]] Error lost_memory() const;
  /// The drive was switched off and on, or may have been.
  void forget_power_cycle();

  // drive_connection.cpp
  /// What one of two nodes with the same node-ID says is not what the other does.
  [[nodiscard]] Result<void> check_alone() const;
  /// The drive counts and brakes as the axis was planned; else misconfigured.
  Task<Result<void>> check_plan();
  Task<Result<std::optional<PlanConflict>>> unit_conflict(SdoOptions options);
  /// Where the drive cannot be told how to brake, and does it softer than its data sheet says.
  Task<Result<std::optional<PlanConflict>>> deceleration_conflict(SdoOptions options);
  Task<Result<void>> set_emergency_id();
  Task<Result<void>> set_heartbeat();
  Task<Result<void>> set_pdos();
  Task<Result<std::string>> set_state_pdos();
  Task<> set_start_pdo();
  /// configure_pdo(), asked for and counted as far as the drive saves it.
  Task<canopen::PdoOutcome> set_pdo(canopen::PdoSettings wanted);
  /// Nothing of them was configured in this power cycle.
  void forget_pdos();
  /// Nothing waits for a SYNC in this drive (M24).
  Task<Result<void>> settle(SdoOptions options);
  Task<Result<void>> disarm(SdoOptions options);
  enum class Waits : std::uint8_t {
    nothing,        ///< nor will
    overwritten,    ///< what did
    until_retyped,  ///< the same, but the RPDO's type lets the next one wait, too
  };
  Task<Result<Waits>> disarm_pdo(std::uint16_t number, SdoOptions options);
  Task<Result<void>> overwrite_waiting(std::uint16_t number, canopen::PdoState state, SdoOptions options);
  [[nodiscard]] bool is_start_pdo(std::uint16_t number, const canopen::PdoState& state) const;
  Task<Result<void>> leave_operational(bool confirmed);
  Task<Result<void>> enter_operational();
  [[nodiscard]] bool is_silent();
  Task<Result<void>> start_node();

  // drive_state.cpp
  void on_event(const canopen::NodeEvent& event);
  void on_emergency(const canopen::Emergency& emergency);
  [[nodiscard]] std::uint16_t alarm_by_emergency() const;
  void on_foreign_command(const std::string& what);
  [[nodiscard]] bool pdos_usable() const;
  [[nodiscard]] bool alive(TimePoint now) const;
  [[nodiscard]] Duration pdo_patience(TimePoint now) const;
  Task<std::optional<Reading>> next_pdos();
  Task<Result<Reading>> poll_objects(SdoOptions options);
  Task<Result<DriveSample>> look(bool by_pdo, SdoOptions options);
  /// r/min up to which a measured velocity may be noise: by 606Fh, where the drive has it.
  [[nodiscard]] int velocity_noise() const;
  [[nodiscard]] DriveSample decoded(const Values& values) const;
  DriveSample judge(const Reading& reading, bool of_one_moment);
  /// A motion may be slower than its velocity shows: than noise, or than one count of it.
  [[nodiscard]] bool known_by_way() const;
  Task<> leave_homing(SdoOptions options);
  void give_up_leaving();
  [[nodiscard]] DriveMode mode_of(const DriveSample& sample, const Reading& reading);
  /// Homing mode in this reading may be the neutral mode, in which nothing homes.
  [[nodiscard]] bool may_be_neutral(const Reading& reading) const;
  /// A terminal with one of these functions is active.
  [[nodiscard]] bool input_active(const DriveSample& sample,
                                  std::initializer_list<std::string_view> functions) const;
  [[nodiscard]] std::optional<DriveMode> terminal_motion(const DriveSample& sample) const;

  // drive_canary.cpp
  [[nodiscard]] MotionBlock fresh_neutral_block() const;
  Task<Result<MotionBlock>> read_block(SdoOptions options);
  /// Writes what differs from what is known to stand there, and verifies it.
  Task<Result<void>> write_canary(MotionBlock block, SdoOptions options);
  /// Reads the block and compares it. The time: before the first of it was asked for.
  Task<Result<TimePoint>> read_canary(SdoOptions options);
  Task<Result<TimePoint>> prove_block(SdoOptions options);

  // drive_stop.cpp
  [[nodiscard]] KnownWords::Moment moment(TimePoint at) const;
  void note_knowledge(const Reading& reading);
  /// The control word as the drive holds it.
  Task<Result<std::uint16_t>> held_control(SdoOptions options);
  Task<Result<void>> write_control(std::uint16_t word, SdoOptions options);
  Task<> wake_if_stopped();
  Task<> wake_unheard();
  Task<> send_control_pdo(std::uint16_t word);
  Task<> zero_velocity(SdoOptions options);
  Task<> choose_halt(bool quick, SdoOptions options);
  /// Of a quick stop, where it has one of its own.
  Task<Result<void>> read_quick_stop_ramp(SdoOptions options);
  /// Its own ramp is softer than that of the motion.
  [[nodiscard]] bool brakes_softer_in_quick_stop() const;
  Task<Result<void>> send_stop(bool quick);
  Task<bool> turns(SdoOptions options);
  Task<Result<void>> choose_mode_soon(OperationMode mode, SdoOptions options);
  Task<Result<void>> halt_again(std::uint16_t bits, SdoOptions options);

  // drive_power.cpp
  Task<Result<State>> read_status(SdoOptions options);
  /// `limit`: until the drive shows it.
  Task<Result<void>> change_mode(OperationMode mode, SdoOptions options,
                                 Duration limit = std::chrono::milliseconds(500));
  [[nodiscard]] bool has_velocity_mode() const { return model_->descriptor->capabilities.velocity_mode; }
  /// 60FFh; 0 where the drive has no velocity mode, and nothing that would follow it.
  Task<Result<std::int64_t>> read_target_velocity(SdoOptions options);
  Task<Result<void>> clear_target_velocity(SdoOptions options);
  Task<Result<void>> enter_neutral_mode(SdoOptions options);
  Task<Result<void>> neutralise(State state, SdoOptions options);
  Task<Result<void>> make_ready(State state, OperationMode mode, SdoOptions options);
  Task<Result<void>> leave_halt(State state, OperationMode mode, std::optional<std::int64_t> position,
                                SdoOptions options);
  Task<Result<void>> stopped_unless(Result<void> watched);
  Task<Result<State>> make_step(Transition step, SdoOptions options);
  Task<Result<void>> step_to_enabled(State state, bool& operates, SdoOptions options);
  Task<> release_again(SdoOptions options);
  Task<Result<void>> confirm_nothing_pending(SdoOptions options);
  Task<Result<void>> watch_standstill(std::int64_t position, SdoOptions options);
  Task<Result<std::optional<std::int64_t>>> read_turning(SdoOptions options);
  Task<Result<void>> reset_fault(SdoOptions options);
  Task<bool> released(SdoOptions options);

  // drive_motion.cpp
  Task<Result<void>> start(MotionBlock block, OperationMode mode, std::optional<HomingProfile> homing,
                           Trigger trigger, MotionGuard guard);
  Task<Result<void>> start_once(MotionBlock block, OperationMode mode, std::optional<HomingProfile> homing,
                                Trigger trigger, MotionGuard guard, bool& triggered);
  [[nodiscard]] Error not_enabled(State state) const;
  /// All that comes before a trigger. The time: as of read_canary().
  Task<Result<TimePoint>> prepare_start(MotionBlock block, OperationMode mode,
                                        std::optional<HomingProfile> homing, SdoOptions motion);
  Task<Result<void>> pull_trigger(OperationMode mode, Trigger trigger, SdoOptions options, bool& triggered);
  Task<> acknowledge_set_point(SdoOptions options);
  Task<Result<void>> prepare_homing(HomingProfile profile, SdoOptions options);
  Task<> see_homing_begin(SdoOptions options);
  [[nodiscard]] Error answers_too_late() const;
  /// M11: what the object would take is 0.
  [[nodiscard]] Error too_slow(Object object) const;
  Task<Result<void>> write_homing_method(HomingProfile profile, SdoOptions options);
  Task<Result<void>> home_here(SdoOptions options);

  // drive_group_start.cpp
  void give_up_common_start();
  /// What waits in the drive for a SYNC follows what it is told, so that no SYNC undoes it.
  Task<> follow_waiting(std::uint16_t word);
  Task<Result<void>> settle_armed(SdoOptions options);
  /// `unbegun`: nothing else was begun with the drive.
  Task<> prove_common_start(MotionGuard unbegun);
  Task<> show_and_judge(std::uint16_t held, SdoOptions options);
  Task<std::string> obstacle_to_proof(SdoOptions options);
  Task<Result<std::string>> show_common_start(std::uint16_t held, SdoOptions options);
  struct ShownStep;
  /// True: the drive did as CiA 301 says.
  Task<Result<bool>> show_step(ShownStep step, std::uint16_t held, SdoOptions options);
  Task<Result<bool>> shows(std::uint16_t word, bool stays, SdoOptions options);
  Task<Result<void>> let_wait(std::uint16_t word, SdoOptions options);
  Task<Result<TimePoint>> check_prepared(MotionBlock block, bool by_sync, SdoOptions options);
  Task<Result<void>> confirm_started();
  [[nodiscard]] canopen::Bytes neutral_bytes() const;
  void note_move_began(TimePoint at);

  // drive_configuration.cpp
  Task<Result<Values>> read_values(std::vector<std::uint32_t> addresses, SdoOptions options);
  [[nodiscard]] std::unique_ptr<DriveMemory> make_memory();
  [[nodiscard]] MemoryTraits memory_traits() const;

  // drive_parameters.cpp
  /// Nothing in the drive's memory that a terminal or a power-up could turn into a motion.
  Task<Result<void>> quieten();
  Task<Result<std::string>> factory_address(const std::vector<std::uint8_t>& taken);
  [[nodiscard]] Error not_supported(std::string message, std::string remedy) const;
  [[nodiscard]] Result<std::vector<ParameterValue>> addressing_objects(const SerialChange& change) const;

  const Model* model_;
  Executor executor_;
  Clock* clock_;
  canopen::CanopenBus* bus_;
  canopen::RemoteNode node_;
  ObjectSetup setup_;
  DriveConfiguration configuration_;
  SeenObjects seen_;

  // The way to the drive.
  Signal news_;  ///< PDOs completed a reading, or something happened to the node
  std::function<void()> attention_;
  NodeContact contact_;
  StateLink state_link_;
  std::optional<std::uint32_t> command_pdo_{};  ///< takes the control word at once
  ForeignMaster foreign_;

  // Starts in common with others.
  StartPdo start_pdo_;

  // What it is known to hold.
  KnownWords words_;
  ObjectCanary canary_;
  StopsSent stops_;

  // What the drive does.
  MotionWatch motion_;
  HomingRun homing_;
};

std::unique_ptr<Drive> make_drive(const Model& model, DriveContext context);

}  // namespace axisd::cia402
