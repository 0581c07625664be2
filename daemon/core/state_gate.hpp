#pragma once

#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "devices/event.hpp"
#include "devices/machine.hpp"
#include "devices/persistence.hpp"

namespace axisd::core {

/// Motion waits while the files of the state convict each other, until somebody accepts that. Thread: core,
/// unless it says otherwise.
class StateGate {
 public:
  using Done = std::function<void(Result<std::vector<Conviction>>)>;

  /// `persistence` may be null: nothing is kept, so nothing is wrong. `tell`: of each change.
  StateGate(Persistence* persistence, std::function<void(KeptStateChange)> tell,
            std::function<void()> changed);

  /// What motion is refused with; the same object for as long as this lives.
  [[nodiscard]] const std::optional<Error>* refusal() const { return &refusal_; }
  /// The same as text; nullptr: motion does not wait. Thread: any.
  [[nodiscard]] boost::shared_ptr<const std::string> unaccepted() const { return unaccepted_.load(); }
  [[nodiscard]] KeptStateReport report() const;
  /// Tells of what stands since the start.
  void start();
  /// As Machine::accept_state().
  void accept(const std::string& client, const Done& done);

 private:
  void set(std::vector<Conviction> convictions);

  Persistence* persistence_;
  std::function<void(KeptStateChange)> tell_;
  std::function<void()> changed_;
  std::vector<Conviction> convictions_;
  std::optional<Error> refusal_;
  boost::atomic_shared_ptr<const std::string> unaccepted_;
  std::shared_ptr<int> alive_ = std::make_shared<int>();  ///< the disk may answer when this is gone
};

}  // namespace axisd::core
