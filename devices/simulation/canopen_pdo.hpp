// PDOs of a simulated node (CiA 301, 7.2.2): mapping, transmission types, timers.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "buses/can/port.hpp"
#include "buses/clock.hpp"
#include "devices/simulation/canopen_objects.hpp"

namespace axisd::simulation {

/// RPDOs of the types 0 to 240: CiA 301 has them applied at the next SYNC, once, with what came last. What it
/// leaves open, and what devices are known to do otherwise.
struct SynchronousReception {
  bool refused = false;          ///< RPDOs take event-driven types only
  bool at_once = false;          ///< applied as soon as it comes, whatever the type
  bool first_counts = false;     ///< what came first waits, later ones are lost
  bool repeated = false;         ///< applied again with each later SYNC
  bool kept = false;             ///< outlives leaving Operational; else it is dropped
  bool applied_by_type = false;  ///< a change to an event-driven type applies what waits
};

struct PdoSettings {
  int rpdos = 4, tpdos = 4;  ///< at most 256 each
  int entries = 4;           ///< of each mapping
  /// Identifiers and numbers of entries are those of the dictionary at power-up; else the identifiers are the
  /// predefined ones of the first 4 PDOs, and each number follows its entries.
  bool from_dictionary = false;
  /// COB-ID and number of entries cannot be written; the number follows the entries. Else as CiA 301 has it:
  /// entries are written while the number is 0.
  bool read_only = false;
  SynchronousReception reception{};
};

/// Adds 14xxh, 16xxh, 18xxh and 1Axxh of at most 4 PDOs each way, all off the wire but with their
/// identifiers, nothing mapped.
void add_pdo_rows(CanopenDictionary& dictionary, const PdoSettings& settings);

class CanopenPdos {
 public:
  using Send = std::function<void(const can::Frame&)>;
  CanopenPdos(const PdoSettings& settings, CanopenObjects& objects, Send send);

  /// Identifiers for `node`, and the numbers of entries that the EEPROM's entries make.
  void boot(std::uint8_t node);
  /// What waited for a SYNC is gone.
  void forget_received();
  /// Of 1400h..1BFFh, before it is stored: an abort code or none.
  [[nodiscard]] std::uint32_t check_write(const ObjectRow& row, std::int64_t value) const;
  void written(const ObjectRow& row);

  /// PDOs are alive (NMT Operational), or not.
  void set_operational(bool operational, TimePoint now);
  /// True: the frame was an RPDO of this node.
  bool on_frame(const can::Frame& frame);
  /// Is this the identifier of an RPDO that listens now?
  [[nodiscard]] bool hears(std::uint32_t id) const;
  void on_sync(TimePoint now);
  void advance(TimePoint now);
  /// Something may have changed: event PDOs are looked at within a cycle of the device (1 ms).
  void touch(TimePoint now);
  [[nodiscard]] TimePoint next_event() const;

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Tpdo {
    std::optional<Bytes> sent;  ///< since operational
    TimePoint inhibited_until{};
    TimePoint timer = TimePoint::max();
    int syncs = 0;
  };
  [[nodiscard]] std::uint32_t check_entry(std::uint16_t index, std::uint8_t sub, std::int64_t value) const;
  [[nodiscard]] std::uint32_t check_count(std::uint16_t index, std::int64_t count) const;
  void follow_entries(std::uint16_t index);
  [[nodiscard]] std::int64_t parameter(std::uint16_t first, int number, std::uint8_t sub) const;
  [[nodiscard]] bool listens(int number) const;
  [[nodiscard]] bool waits_for_sync(int number) const;
  void receive(int number, Bytes bytes);
  [[nodiscard]] bool transmits(int number) const;
  [[nodiscard]] bool by_event(int number) const;
  void apply(int number, const Bytes& bytes);
  [[nodiscard]] Bytes pack(int number) const;
  void transmit(int number, Bytes bytes, TimePoint now);
  void start_timer(int number, TimePoint now);
  void look(TimePoint now);

  PdoSettings settings_;
  CanopenObjects* objects_;
  Send send_;
  bool operational_ = false;
  std::vector<Tpdo> tpdos_;
  std::vector<std::optional<Bytes>> held_;  ///< by RPDO: waits for the next SYNC
  TimePoint looked_{}, look_due_ = TimePoint::max();
};

}  // namespace axisd::simulation
