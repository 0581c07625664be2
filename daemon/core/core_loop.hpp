#pragma once

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/asio_clock.hpp"
#include "buses/clock.hpp"
#include "buses/gate.hpp"
#include "buses/task.hpp"
#include "daemon/core/ready_queue.hpp"

namespace axisd::core {

enum class StopReach : std::uint8_t {
  named,    ///< some axes
  machine,  ///< every axis
};

/// Stops overtake everything that waits for the core thread: the lane is emptied before each handler
/// (drain() says how far), and the sequences that serve a stop run at once to their first wait. Asking for a
/// stop makes the axes' prepared motion unsendable at once, from the asking thread. Thread: any.
class StopLane {
 public:
  explicit StopLane(ReadyQueue& core) : core_(&core) {}
  /// `serve` stops the axes of all `gates`; none where only the core knows which.
  void request(std::vector<std::shared_ptr<AxisGate>> gates, std::function<void()> serve,
               std::string client = {}, StopReach reach = StopReach::named);
  /// Serves one request of each client in turn, those of the whole machine before all others, also before
  /// what the same client asked for earlier: on one computer all may be one client. Who has stopped `share`
  /// axes goes on once the handlers that wait by then have run, so that no crowd of stops keeps another's
  /// from the drives. False: there was none to serve. Thread: core.
  bool drain();
  /// Axes of the requests of an identity, also of all whom it speaks for, that have not been served yet; a
  /// request of no axis counts as one.
  [[nodiscard]] std::size_t waiting(std::string_view identity) const;

  static constexpr std::size_t share = 64;

 private:
  struct Request {
    std::vector<std::shared_ptr<AxisGate>> gates;
    std::function<void()> serve;
    std::string client;
    StopReach reach = StopReach::named;
    [[nodiscard]] std::size_t axes() const { return std::max<std::size_t>(1, gates.size()); }
  };
  struct Turn {
    std::deque<Request> of_machine, of_axes;
    std::size_t served = 0;  ///< axes, since it began or went on
    [[nodiscard]] bool is_over() const { return of_machine.empty() && of_axes.empty(); }
  };
  using Turns = std::map<std::string, Turn>;
  void take_in();
  [[nodiscard]] std::optional<Request> next();
  [[nodiscard]] std::optional<Request> next(std::deque<Request> Turn::* of);
  void serve(Request request);
  void go_on(const std::string& client);

  ReadyQueue* core_;
  std::atomic<bool> waiting_{false};
  Turns turns_;       ///< of the core
  std::string last_;  ///< of the core: who was served last
  mutable std::mutex mutex_;
  std::vector<Request> requests_;                             ///< under mutex_
  std::map<std::string, std::size_t, std::less<>> unserved_;  ///< under mutex_: axes of each identity
};

/// The core thread's loop.
class CoreLoop {
 public:
  CoreLoop();
  /// With a time of its own, which must outlive the loop; whoever lets it pass calls step() instead of run().
  explicit CoreLoop(Clock& clock);
  ~CoreLoop();
  CoreLoop(const CoreLoop&) = delete;
  [[nodiscard]] Executor executor() { return CoreExecutor(ready_); }
  [[nodiscard]] Clock& clock() { return *clock_; }
  [[nodiscard]] StopLane& lane() { return lane_; }

  /// Runs handlers until stop(), and what the clock has to call before each of them. Precondition: the clock
  /// is its own. Thread: becomes the core thread.
  void run();
  /// Serves stops that wait and one handler that is ready, or takes input; with `wait` for some that is yet
  /// to come. False: there was nothing, or stop() was called. Thread: becomes the core thread.
  bool step(bool wait = false);
  /// Thread: any.
  void stop();
  /// When the loop last came round. Thread: any.
  [[nodiscard]] TimePoint last_progress() const { return last_progress_.load(std::memory_order_relaxed); }
  /// Longest single handler since the last call. Thread: any.
  [[nodiscard]] Duration take_longest_handler() {
    return Duration(longest_.exchange(0, std::memory_order_relaxed));
  }

 private:
  bool run_ready();

  ReadyQueue ready_{io_};  ///< outlives what `io_` still holds at its end
  boost::asio::io_context io_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  int since_input_ = 0;  ///< handlers since input was looked for
  std::optional<AsioClock> own_clock_;
  Clock* clock_;
  StopLane lane_;
  std::atomic<TimePoint> last_progress_{};
  std::atomic<Duration::rep> longest_{0};
};

}  // namespace axisd::core
