// How this machine stays registered in etcd, and knows who else is. Pure: time and answers come in, what to
// ask goes out.
//
//   resting ----pause over----> looking          (at the next endpoint: list, then watch from there)
//   looking ----listed--------> listening        (nothing to register is known yet)
//   listening --offered-------> granting         (a lease)
//   granting ---granted-------> writing          (the own key, if nobody has it, or this computer)
//   writing ----written-------> registered
//   writing ----held----------> refused          (by another computer)
//   refused ----pause over, or the key is gone-> granting
//   registered -key or lease gone, offered another-> granting, or writing
//   any -------lost, or nothing heard-> resting  (what is known stays)
//   any -------end------------> ended
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "api/cell/kept.pb.h"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Thread: core.
class RegistryMachine {
 public:
  enum class State : std::uint8_t {
    resting,
    looking,
    listening,
    granting,
    writing,
    registered,
    refused,
    ended
  };
  struct Times {
    Duration pause = std::chrono::milliseconds(250);  ///< after an endpoint was lost
    Duration again = std::chrono::seconds(1);         ///< between two registrations
    Duration refused = std::chrono::seconds(10);  ///< after a refusal; the watch tells when the name is free
    Duration answer = std::chrono::seconds(3);    ///< of whatever was asked; of the watch: progress
    Duration progress = std::chrono::seconds(1);  ///< how often the watch is asked for it
    Duration keep_alive = std::chrono::seconds(5);  ///< how often the lease is renewed
  };

  /// What to do. Answers to what was asked before a Look are not handed in any more.
  struct Look {
    std::size_t endpoint;
  };
  struct Grant {};
  struct Write {
    std::int64_t lease;
    kept::Registration value;
  };
  struct KeepAlive {
    std::int64_t lease;
  };
  struct AskProgress {};
  /// Leave the endpoint alone: everything that is under way there ends.
  struct Leave {};
  using Effect = std::variant<Look, Grant, Write, KeepAlive, AskProgress, Leave>;
  using Effects = std::vector<Effect>;

  using Machines = std::map<std::string, kept::Registration, std::less<>>;

  /// `name`: of this machine. `endpoints`: how many there are, at least one.
  RegistryMachine(std::string name, std::size_t endpoints, Times times);

  /// Each returns what to do now.
  [[nodiscard]] Effects start(TimePoint now);
  /// To be called at due(), or later.
  [[nodiscard]] Effects time(TimePoint now);
  /// What this machine registers as. The same as before does nothing.
  [[nodiscard]] Effects offer(TimePoint now, const kept::Registration& own);
  /// All that is registered, at the time when the watch begins.
  [[nodiscard]] Effects listed(TimePoint now, Machines machines);
  /// From the watch. nullopt: the key is gone.
  [[nodiscard]] Effects changed(TimePoint now, const std::string& name,
                                std::optional<kept::Registration> registration);
  /// From the watch: it goes on.
  void heard(TimePoint now);
  [[nodiscard]] Effects granted(TimePoint now, std::int64_t lease);
  [[nodiscard]] Effects written(TimePoint now);
  /// The own key is another computer's.
  [[nodiscard]] Effects held(TimePoint now, const kept::Registration& holder);
  /// `alive`: etcd still has the lease.
  [[nodiscard]] Effects kept_alive(TimePoint now, bool alive);
  /// The endpoint does not do what it was asked for. `why`: for people.
  [[nodiscard]] Effects lost(TimePoint now, std::string why);

  /// Nothing is wanted of etcd any more, and nothing that it says is listened to.
  void end();

  [[nodiscard]] TimePoint due() const;
  [[nodiscard]] State state() const { return state_; }
  /// As last known, also while no endpoint answers.
  [[nodiscard]] const Machines& machines() const { return machines_; }
  /// Counts what machines() and state() and trouble() have been.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// Why this machine is not registered, for people; empty: it is.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// Who has this machine's name; nullptr: nobody else.
  [[nodiscard]] const kept::Registration* holder() const { return holder_ ? &*holder_ : nullptr; }
  /// When an endpoint was last heard of.
  [[nodiscard]] std::optional<TimePoint> last_heard() const { return heard_; }
  /// The lease that this machine is registered under; 0: it is not.
  [[nodiscard]] std::int64_t lease() const { return state_ == State::registered ? lease_ : 0; }

 private:
  [[nodiscard]] Effects look(TimePoint now);
  [[nodiscard]] Effects grant(TimePoint now);
  [[nodiscard]] Effects write(TimePoint now);
  [[nodiscard]] Effects on_own_key_gone(TimePoint now);
  /// `until`: when the answer has to be there.
  void enter(State state, TimePoint until);
  void tell(std::string trouble);
  [[nodiscard]] bool watches() const {
    return state_ != State::resting && state_ != State::looking && state_ != State::ended;
  }

  const std::string name_;
  const std::size_t endpoints_;
  const Times times_;
  State state_ = State::resting;
  std::size_t endpoint_ = 0;
  std::optional<kept::Registration> own_, holder_;
  Machines machines_;
  std::int64_t lease_ = 0;
  std::string trouble_;
  std::uint64_t revision_ = 0;
  /// When the present state has to be left; while registered: when the lease is to be renewed.
  TimePoint until_ = TimePoint::max();
  TimePoint ask_progress_ = TimePoint::max(), not_before_{};
  bool renewing_ = false;
  std::optional<TimePoint> heard_;
};

}  // namespace axisd::cell
