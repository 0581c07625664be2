// A CANopen master on a network that the test plays: it sees every frame and answers as it likes.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "buses/canopen/cob.hpp"
#include "buses/canopen/master.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::canopen::test {

using namespace std::chrono_literals;
using axisd::test::VirtualWorld;

/// Takes every frame at once and confirms it after `frame_time`.
class FakePort final : public can::Port {
 public:
  explicit FakePort(VirtualWorld& world) : world_(&world) { state_.link = can::InterfaceState::up; }

  void start(can::PortHandlers handlers) override { handlers_ = std::move(handlers); }
  void send(const can::Frame& frame, const can::SendOptions& options, can::Completion completion) override {
    timers_.push_back(world_->clock().call_at(
        world_->now() + frame_time, [this, frame, options, completion = std::move(completion)] {
          if (silent_) return;
          auto verdict = may_send(options.guard, world_->now());
          for (const auto& guard : options.more_guards)
            if (verdict == Verdict::send) verdict = may_send(guard, world_->now());
          auto status = next_status;
          if (!state_.can_send()) status = can::SendStatus::port_down;
          if (verdict != Verdict::send) status = can::SendStatus::superseded;
          if (world_->now() > options.deadline) status = can::SendStatus::expired;
          completion({.status = status, .handed_over = world_->now(), .sent_at = world_->now()});
          if (status != can::SendStatus::sent) return;
          log.push_back(can::to_string(frame));
          times.push_back(world_->now());
          classes.push_back(options.transaction_class);
          if (on_sent) on_sent(frame);
        }));
  }
  void purge_superseded(const AxisGate& /*gate*/) override { ++purges; }
  void close() override { silent_ = true; }
  [[nodiscard]] const can::PortState& state() const override { return state_; }
  [[nodiscard]] const can::PortCounters& counters() const override { return counters_; }
  [[nodiscard]] const can::PortSettings& settings() const override { return settings_; }

  void receive(std::uint32_t id, const Bytes& bytes, bool rtr = false) {
    auto frame = can::make_frame(id, bytes);
    frame.rtr = rtr;
    handlers_.on_frame({.frame = frame, .at = world_->now()});
  }
  void receive(std::uint32_t id, const SdoData& data) { receive(id, Bytes(data.begin(), data.end())); }
  void set_link(can::InterfaceState link) {
    state_.link = link;
    handlers_.on_state(state_);
  }

  Duration frame_time = 100us;
  can::SendStatus next_status = can::SendStatus::sent;
  std::function<void(const can::Frame&)> on_sent;
  std::vector<std::string> log;  ///< what was sent, as candump writes it
  std::vector<TimePoint> times;
  std::vector<TransactionClass> classes;
  int purges = 0;

 private:
  VirtualWorld* world_;
  can::PortHandlers handlers_;
  can::PortState state_;
  can::PortCounters counters_;
  can::PortSettings settings_{.bus = "can0", .interface = "sim"};
  std::vector<Clock::Timer> timers_;
  bool silent_ = false;
};

/// One SDO server with an object dictionary of numbers; expedited only.
struct FakeServer {
  struct Entry {
    std::uint64_t value = 0;
    std::size_t size = 4;
    bool writable = true;
  };
  std::map<Object, Entry> objects;
  std::map<Object, std::uint32_t> refusals;  ///< abort codes of writes
  std::vector<std::string> writes;           ///< "1800h:01=80000181"
  bool answers = true;

  std::optional<SdoData> answer(const can::Frame& request) {
    const auto& data = request.data;
    const Object object{static_cast<std::uint16_t>(data[1] | data[2] << 8), data[3]};
    if (!answers || data[0] == 0x80) return std::nullopt;
    const auto entry = objects.find(object);
    if (entry == objects.end()) return abort_frame(object, 0x06020000);
    SdoData reply{0x60, data[1], data[2], data[3]};
    if (data[0] == 0x40) {
      reply[0] = static_cast<std::uint8_t>(0x43 | (4 - entry->second.size) << 2);
      for (std::size_t i = 0; i < 4; ++i)
        reply[4 + i] = static_cast<std::uint8_t>(entry->second.value >> 8 * i);
      return reply;
    }
    if (const auto refused = refusals.find(object); refused != refusals.end())
      return abort_frame(object, refused->second);
    if (!entry->second.writable) return abort_frame(object, 0x06010002);
    entry->second.value = number_of(std::span(data).subspan(4));
    char text[32];
    std::snprintf(text, sizeof text, "=%X", static_cast<unsigned>(entry->second.value));
    writes.push_back(to_string(object) + text);
    return reply;
  }
};

struct Network {
  VirtualWorld world;
  FakePort* port = nullptr;
  std::unique_ptr<Master> master;
  std::map<std::uint8_t, FakeServer> servers;
  std::map<std::string, Result<SdoAnswer>> results;
  std::vector<NodeEvent> events;
  std::vector<Emergency> emergencies;
  std::deque<Clock::Timer> timers;
  Duration turnaround = 1ms;

  explicit Network(SdoSettings settings = {}) {
    auto made = std::make_unique<FakePort>(world);
    port = made.get();
    port->on_sent = [this](const can::Frame& frame) { serve(frame); };
    master = std::make_unique<Master>(world.executor(), world.clock(), std::move(made), settings);
    master->start({.on_node = [this](const NodeEvent& event) { events.push_back(event); },
                   .on_emergency = [this](const Emergency& one) { emergencies.push_back(one); },
                   .on_port = {}});
  }
  ~Network() {
    master->close();
    world.run_for(1s);
  }
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  void serve(const can::Frame& frame) {
    const auto to = classify(frame.id);
    const auto server = servers.find(to.node);
    if (to.service != Service::sdo_request || server == servers.end()) return;
    if (const auto reply = server->second.answer(frame)) reply_after(turnaround, to.node, *reply);
  }
  void reply_after(Duration delay, std::uint8_t node, SdoData data) {
    timers.push_back(world.clock().call_at(world.now() + delay,
                                           [this, node, data] { port->receive(sdo_reply_id(node), data); }));
  }
  void upload(std::string name, std::uint8_t node, Object object, SdoOptions options = {}) {
    auto one = [](Network& net, std::string key, std::uint8_t n, Object o, SdoOptions how) -> Task<> {
      auto result = co_await net.master->sdo().upload(n, o, std::move(how));
      net.results.insert_or_assign(std::move(key), std::move(result));
    };
    spawn(world.executor(), one(*this, std::move(name), node, object, std::move(options)), "test");
  }
  void download(std::string name, std::uint8_t node, Object object, Bytes bytes, SdoOptions options = {}) {
    auto one = [](Network& net, std::string key, std::uint8_t n, Object o, Bytes b,
                  SdoOptions how) -> Task<> {
      auto result = co_await net.master->sdo().download(n, o, std::move(b), std::move(how));
      net.results.insert_or_assign(std::move(key), std::move(result));
    };
    spawn(world.executor(), one(*this, std::move(name), node, object, std::move(bytes), std::move(options)),
          "test");
  }
  [[nodiscard]] ClassStatistics counted(TransactionClass transaction_class) const {
    return master->sdo().classes().at(std::to_underlying(transaction_class));
  }
  /// Runs `task` to its end and gives its value.
  template <class T>
  T run(Task<T> task) {
    std::optional<T> value;
    auto one = [](Task<T> inner, std::optional<T>& to) -> Task<> { to.emplace(co_await std::move(inner)); };
    spawn(world.executor(), one(std::move(task), value), "test");
    world.run_until([&value] { return value.has_value(); }, 60s);
    return std::move(value.value());
  }
};

}  // namespace axisd::canopen::test
