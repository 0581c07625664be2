#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <string>

#include "api/cell/kept.pb.h"
#include "api/cell/machines.hpp"
#include "api/cell/settings.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// What this machine registers as, as its axisd says. Thread: core.
class OwnMachine {
 public:
  /// `settings` and `machines` outlive this. `changed`: it may be another now.
  OwnMachine(boost::asio::any_io_executor core, Clock& clock, const Settings& settings,
             std::string machine_id, Machines& machines,
             std::function<void(const kept::Registration&)> changed);

  /// From now on its axisd is asked.
  void start() { look(); }
  /// It is asked no more.
  void end() { timer_.reset(); }
  /// Its axisd has said who it is: another run of it is asked at once.
  void seen(const std::string& instance_id) {
    if (instance_id != instance_id_) look();
  }

 private:
  void look();
  void offer();

  boost::asio::any_io_executor core_;
  Clock& clock_;
  const Settings& settings_;
  const std::string machine_id_;
  Machines& machines_;
  const std::function<void(const kept::Registration&)> changed_;
  kept::Registration registration_;
  std::string instance_id_;  ///< the run of its axisd that registration_ is of
  Clock::Timer timer_;
};

}  // namespace axisd::cell
