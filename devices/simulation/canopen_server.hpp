// The CiA 301 side of a simulated node: NMT, boot-up, heartbeat, SDO, PDO, SYNC, EMCY, in the time it is
// given.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "buses/can/port.hpp"
#include "buses/clock.hpp"
#include "devices/simulation/canopen_objects.hpp"
#include "devices/simulation/canopen_pdo.hpp"
#include "devices/simulation/canopen_sdo_server.hpp"

namespace axisd::simulation {

enum class NmtState : std::uint8_t { off, booting, pre_operational, operational, stopped };

struct CanopenServerSettings {
  PdoSettings pdos{};
  SdoServerSettings sdo{};
  /// From the end of a request to its answer in the node's transmit buffer. The manuals give no figure.
  Duration reply_latency = std::chrono::microseconds(500);
  /// 1014h is this plus the node-ID, unless it was written.
  std::uint32_t emergency_base = 0x80;
  bool emergency_base_alone = false;  ///< without the node-ID
  bool error_count_grows = false;     ///< 1003h:00 is the number of errors; else as its row says
};

/// Adds what each CiA 301 device has beside its PDOs: 1000h, 1001h, 1003h (`errors` entries), 1005h, 1014h,
/// 1017h, 1018h, 1200h.
struct CanopenIdentity {
  std::uint32_t device_type = 0x00020192;
  std::uint32_t vendor = 0, product = 0, revision = 0;
  int entries = 3;  ///< of 1018h
  int errors = 4;   ///< entries of 1003h
};
void add_communication_rows(CanopenDictionary& dictionary, const CanopenIdentity& identity);

/// Not thread-safe: that of its node.
class CanopenServer {
 public:
  /// `reset`: NMT asks for a reset of the node, or (true) of its communication only; the device calls boot().
  CanopenServer(const CanopenServerSettings& settings, CanopenDictionary& dictionary, CanopenHooks hooks,
                std::function<void(bool communication_only)> reset);
  CanopenServer(const CanopenServer&) = delete;

  /// Silent until `ready`, then the boot-up message follows. Precondition: the dictionary has its power-up
  /// values.
  void boot(std::uint8_t node, TimePoint ready);
  /// Has booted long ago.
  void boot_quietly(std::uint8_t node, TimePoint now);
  void switch_off();

  [[nodiscard]] std::uint8_t node() const { return node_; }
  [[nodiscard]] NmtState state() const { return state_; }
  /// It listens and speaks (not off, not booting, and it has a node-ID).
  [[nodiscard]] bool alive() const { return node_ != 0 && state_ > NmtState::booting; }
  [[nodiscard]] CanopenObjects& objects() { return objects_; }
  [[nodiscard]] const CanopenObjects& objects() const { return objects_; }

  void on_frame(const can::Frame& frame, TimePoint now);
  /// False: on_frame() would do nothing.
  [[nodiscard]] bool hears(const can::Frame& frame) const;
  void advance(TimePoint now);
  [[nodiscard]] TimePoint next_event() const;
  std::optional<can::Frame> take_frame();

  /// Objects may have changed by themselves: event PDOs are to look.
  void touch(TimePoint now) { pdos_.touch(now); }
  /// Sends EMCY with 1001h = `error_register` and remembers it in 1003h; code 0: the error is gone.
  void emergency(std::uint16_t code, std::uint8_t error_register, std::array<std::uint8_t, 5> vendor = {});

 private:
  CanopenHooks wrap(CanopenHooks hooks);
  std::uint32_t check_write(const ObjectRow& row, std::int64_t value) const;
  void written(const ObjectRow& row);
  [[nodiscard]] std::uint32_t emergency_cob() const;
  void begin(std::uint8_t node);
  void on_nmt(std::uint8_t command, TimePoint now);
  void set_state(NmtState state, TimePoint now);
  void send(const can::Frame& frame) { out_.push_back(frame); }
  void send_heartbeat(TimePoint now);
  [[nodiscard]] Duration heartbeat_time() const;

  CanopenServerSettings settings_;
  CanopenDictionary* dictionary_;
  CanopenHooks device_;
  std::function<void(bool)> reset_;
  CanopenObjects objects_;
  CanopenPdos pdos_;
  CanopenSdoServer sdo_;
  std::uint8_t node_ = 0;
  NmtState state_ = NmtState::off;
  TimePoint now_{}, ready_ = TimePoint::max(), heartbeat_ = TimePoint::max();
  std::deque<std::pair<TimePoint, can::Frame>> replies_;
  std::deque<can::Frame> out_;
};

}  // namespace axisd::simulation
