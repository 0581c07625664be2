#include "daemon/core/core_loop.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

#include "buses/heartbeat.hpp"
#include "devices/access.hpp"

namespace axisd::core {
namespace {

/// Handlers that may run before input is looked for.
constexpr int most_ready = 32;

}  // namespace

void StopLane::request(std::vector<std::shared_ptr<AxisGate>> gates, std::function<void()> serve,
                       std::string client, StopReach reach) {
  for (const auto& gate : gates) gate->request_stop();
  {
    const std::lock_guard lock(mutex_);
    requests_.push_back(
        {.gates = std::move(gates), .serve = std::move(serve), .client = std::move(client), .reach = reach});
    unserved_[std::string(identity_of(requests_.back().client))] += requests_.back().axes();
  }
  waiting_.store(true, std::memory_order_release);
  post(core_->io(), [] {});  // wakes the loop, which looks at the lane first
}

bool StopLane::drain() {
  bool served = false;
  for (take_in(); !turns_.empty(); take_in()) {
    auto request = next();
    if (!request) break;
    last_ = request->client;
    auto& turn = turns_.at(last_);
    const bool first = turn.served == 0;
    turn.served += request->axes();
    serve(*std::move(request));
    if (first) core_->push([this, client = last_] { go_on(client); });
    served = true;
  }
  return served;
}

void StopLane::take_in() {
  if (!waiting_.exchange(false, std::memory_order_acq_rel)) return;
  std::vector<Request> requests;
  {
    const std::lock_guard lock(mutex_);
    requests = std::exchange(requests_, {});
  }
  for (auto& request : requests) {
    auto& turn = turns_[request.client];
    (request.reach == StopReach::machine ? turn.of_machine : turn.of_axes).push_back(std::move(request));
  }
}

/// Nothing: nobody has one that may be served now.
std::optional<StopLane::Request> StopLane::next() {
  auto request = next(&Turn::of_machine);
  return request ? std::move(request) : next(&Turn::of_axes);
}

/// Of the clients behind the last one.
std::optional<StopLane::Request> StopLane::next(std::deque<Request> Turn::* of) {
  const auto may = [of](const auto& turn) {
    return !(turn.second.*of).empty() && turn.second.served < share;
  };
  auto found = std::find_if(turns_.upper_bound(last_), turns_.end(), may);
  if (found == turns_.end()) found = std::find_if(turns_.begin(), turns_.end(), may);
  if (found == turns_.end()) return std::nullopt;
  auto& requests = found->second.*of;
  auto request = std::move(requests.front());
  requests.pop_front();
  return request;
}

void StopLane::serve(Request request) {
  core_->run_first(request.serve);
  {
    const std::lock_guard lock(mutex_);
    const auto unserved = unserved_.find(identity_of(request.client));
    unserved->second -= request.axes();
    if (unserved->second == 0) unserved_.erase(unserved);
  }
  // A sequence that was waiting already is resumed by a handler, which comes before this one.
  core_->push([gates = std::move(request.gates)] {
    for (const auto& gate : gates) gate->stop_passed_on();
  });
}

std::size_t StopLane::waiting(std::string_view identity) const {
  const std::lock_guard lock(mutex_);
  const auto found = unserved_.find(identity);
  return found == unserved_.end() ? 0 : found->second;
}

void StopLane::go_on(const std::string& client) {
  const auto turn = turns_.find(client);
  if (turn->second.is_over())
    turns_.erase(turn);
  else
    turn->second.served = 0;
}

CoreLoop::CoreLoop()
    : work_(boost::asio::make_work_guard(io_)),
      clock_(&own_clock_.emplace(io_, AsioClock::Served::by_loop)),
      lane_(ready_) {}

CoreLoop::CoreLoop(Clock& clock) : work_(boost::asio::make_work_guard(io_)), clock_(&clock), lane_(ready_) {}

CoreLoop::~CoreLoop() { ready_.clear(); }

/// One handler that is ready. False: there is none, or it is time to look for input.
bool CoreLoop::run_ready() {
  if (ready_.empty() || ++since_input_ > most_ready) {
    since_input_ = 0;
    return false;
  }
  ready_.run_one();
  return true;
}

void CoreLoop::run() {
  const ReadyQueue::Here here(ready_);
  // So that the watchdog sees an idle loop alive.
  Clock::Timer beat;
  const std::function<void()> beats = [&] { beat = clock_->call_at(clock_->now() + heartbeat, beats); };
  beats();
  auto began = monotonic_now();
  while (!io_.stopped()) {
    last_progress_.store(began, std::memory_order_relaxed);
    const bool stopped = lane_.drain();
    // What is due comes before handlers: frames that wait to be read can be read a little later, SYNC cannot
    // be sent late.
    const bool served = own_clock_->serve(began);
    const bool ran = run_ready();
    if (stopped || served || ran) {
      const auto ended = monotonic_now();
      const auto took = (ended - std::exchange(began, ended)).count();
      if (took > longest_.load(std::memory_order_relaxed)) longest_.store(took, std::memory_order_relaxed);
    }
    if (ran) continue;
    if (ready_.empty()) {
      own_clock_->wake_in_time();
      io_.run_one();
    } else {
      io_.poll_one();
    }
    began = monotonic_now();
  }
}

bool CoreLoop::step(bool wait) {
  const ReadyQueue::Here here(ready_);
  lane_.drain();
  if (run_ready()) return true;
  if (io_.poll_one() > 0 || !ready_.empty()) return true;
  return wait && io_.run_one() > 0;
}

void CoreLoop::stop() { io_.stop(); }

}  // namespace axisd::core
