// A move of axes of several machines, from one moment on: what is to be asked of whom. Pure.
#pragma once

#include <grpcpp/support/status.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/cell/clock_samples.hpp"
#include "axisd/cell/v1/cell_service.pb.h"
#include "buses/clock.hpp"

namespace axisd::cell {

[[nodiscard]] bool has_ended(axisd::v1::CommandState state);
/// It was told to start, by whomever.
[[nodiscard]] bool was_told(const axisd::v1::GroupMove& move);

/// Each machine prepares its part, tells its clock, is told a moment of that clock, and is renewed from then
/// on. It starts only once a renewal has said that all were told, and stops by itself where renewals end: so
/// where this process is gone, none starts, or all stop.
///
///   preparing --- all are prepared ------------------> measuring
///   preparing --- all have ended --------------------> over       a repeated request
///   measuring --- all clocks are known well enough --> telling
///   telling ----- all have taken their moment -------> running
///   running ----- all are done ----------------------> over
///   attached ---- all have ended, or cannot be asked > over
///   preparing, measuring, telling, running
///            ---- one refuses, fails, ends or is lost, or it is too late,
///                 for a machine or for the caller -----------------------> giving_up
///   giving_up --- all have ended, or no longer answer --------------------> over
///   any but over
///            ---- another entrance has told one, for the same request -----> attached
///
/// What one refuses or does not answer while it is prepared is judged once all have answered: another
/// entrance may have told one of the others. Only `giving_up` stops anybody, and only what has the moment of
/// this entrance. Whoever waits for a moment is told one first, that is never said to be everybody's: where
/// it takes that, no other entrance can start it any more; where it does not, another one has told it.
/// Thread: core.
class GroupMoveMachine {
 public:
  enum class State : std::uint8_t {
    preparing,  ///< each is asked to prepare its part
    measuring,  ///< each is asked for its clock
    telling,    ///< each is told its moment
    running,    ///< all were told, and are renewed until they are done
    attached,   ///< another entrance does this: it is only looked at
    giving_up,  ///< all are stopped
    over,
  };

  /// One thing that is to be asked. Its answer comes by the function of the same name.
  struct Errand {
    enum class Kind : std::uint8_t { prepare, measure, tell, renew, cancel, look } kind;
    std::size_t machine;  ///< index
    Duration at{};        ///< of tell: by its clock
    bool all_told = false;
  };
  using Errands = std::vector<Errand>;

  /// What a machine has answered.
  struct Answer {
    TimePoint sent, received;
    grpc::Status status{};
    axisd::v1::GroupMove move{};  ///< where the status is OK, as the clock
    Duration clock{};
  };

  static constexpr int round_trips = 16;
  /// A machine stops 500 ms after the last one that reached it.
  static constexpr Duration renewal_period = std::chrono::milliseconds(150);
  /// How often those are looked at that are not renewed.
  static constexpr Duration look_period = std::chrono::milliseconds(100);
  /// Between the choice of the moment and when machines begin to look at their members for the last time.
  static constexpr Duration lead = std::chrono::milliseconds(400);
  /// So long it is looked at what became of machines that were stopped.
  static constexpr Duration longest_end = std::chrono::seconds(5);

  /// So long a machine may be silent that is only looked at.
  static constexpr Duration longest_silence = std::chrono::seconds(3);

  struct Limits {
    Duration clock_tolerance;               ///< a clock has to be known better than this
    TimePoint start_by = TimePoint::max();  ///< until then the caller waits: nobody starts later (M31)
  };
  GroupMoveMachine(std::vector<std::string> machines, const Limits& limits);

  [[nodiscard]] Errands begin();
  [[nodiscard]] Errands prepared(std::size_t machine, const Answer& answer);
  [[nodiscard]] Errands measured(std::size_t machine, const Answer& answer);
  [[nodiscard]] Errands told(std::size_t machine, const Answer& answer);
  [[nodiscard]] Errands renewed(std::size_t machine, const Answer& answer);
  [[nodiscard]] Errands cancelled(std::size_t machine, const grpc::Status& status);
  [[nodiscard]] Errands looked(std::size_t machine, const Answer& answer);
  /// To be called every 50 ms.
  [[nodiscard]] Errands tick(TimePoint now);

  [[nodiscard]] State state() const { return state_; }
  /// How it stands, as far as is known; once it is over, how it ended.
  [[nodiscard]] v1::CellGroupMove value() const { return ended_as_ ? *ended_as_ : make_value(); }
  /// It has come as far, or is over.
  [[nodiscard]] bool reached(axisd::v1::WaitUntil until) const;
  /// Of the move at this machine; empty: it is not prepared.
  [[nodiscard]] const std::string& id_at(std::size_t machine) const { return parts_[machine].move.id(); }
  /// Its commands that have not ended, as far as is known.
  [[nodiscard]] std::vector<std::string> commands_at(std::size_t machine) const;
  /// Something of it may have been started: by this entrance, another one, or an earlier attempt.
  [[nodiscard]] bool may_have_started() const { return may_have_started_; }
  /// Once it is over, why this entrance has started nothing. OK: something may have been started.
  [[nodiscard]] const grpc::Status& refusal() const {
    return may_have_started_ ? grpc::Status::OK : refusal_;
  }

 private:
  struct Part {
    enum class Stage : std::uint8_t {
      asked,     ///< whether it is prepared is not known yet
      prepared,  ///< it waits for its moment
      told,      ///< it has its moment
      foreign,   ///< another entrance has told it
      ended,     ///< nothing of it moves, or will, as far as is known
      lost,      ///< it refused this entrance, or cannot be asked: of an earlier attempt it says nothing
    };
    std::string machine;
    Stage stage = Stage::asked;
    std::optional<Duration> at{};  ///< that this entrance has told it, or is about to
    axisd::v1::GroupMove move{};
    std::optional<axisd::v1::ErrorDetail> error{};
    ClockSamples clock{};
    TimePoint next{};                         ///< when it is to be asked again
    std::optional<TimePoint> silent_since{};  ///< while it is only looked at
    bool stopping = false;
  };

  [[nodiscard]] bool all(Part::Stage stage) const;
  [[nodiscard]] bool any(Part::Stage stage) const;
  [[nodiscard]] static bool is_out(const Part& part) {
    return part.stage == Part::Stage::ended || part.stage == Part::Stage::lost;
  }
  /// What a machine says of its part.
  void take(Part& part, const axisd::v1::GroupMove& move);
  /// Takes an answer. False: it ends all, or another entrance has told the machine.
  [[nodiscard]] bool goes_on(std::size_t machine, const Answer& answer, Errands& errands);
  [[nodiscard]] Errands judge_prepared(TimePoint now);
  [[nodiscard]] Errands choose_moment(TimePoint now);
  [[nodiscard]] Errands give_up(axisd::v1::ErrorDetail cause, grpc::StatusCode code, TimePoint now);
  [[nodiscard]] Errands fail(std::size_t machine, const grpc::Status& status, TimePoint now);
  /// Of an answer of any kind, while all are stopped.
  [[nodiscard]] Errands take_while_giving_up(std::size_t machine, const Answer& answer);
  /// One that has not ended is stopped if it has the moment of this entrance, else told one; and looked at.
  void end_part(std::size_t machine, TimePoint now, Errands& errands);
  void stop_part(std::size_t machine, Errands& errands);
  void end_if_over();
  /// Only how it ended is kept.
  void end();
  void attach();
  // group_move_report.cpp
  [[nodiscard]] v1::CellGroupMove make_value() const;
  [[nodiscard]] axisd::v1::CommandState result() const;
  void fill_skew(v1::CellGroupMove& to) const;

  State state_ = State::preparing;
  const Limits limits_;
  std::vector<Part> parts_;
  std::optional<axisd::v1::ErrorDetail> cause_;
  grpc::Status refusal_;  ///< why this entrance would not go on
  bool may_have_started_ = false;
  std::optional<v1::CellGroupMove> ended_as_;
  TimePoint latest_told_{};  ///< all have to be told by then
  TimePoint end_by_ = TimePoint::max();
};

}  // namespace axisd::cell
