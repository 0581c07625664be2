// Giving way to another axis of the same name, or to none: what a reload of the configuration asks for.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/axis/axis.hpp"

namespace axisd {

/// Everything that would be lost, or be done by nobody, if the axis went away now.
std::vector<Error> Axis::check_exchange(bool energised) const {
  std::vector<Error> found;
  const auto add = [&](Reason reason, std::string message, std::string remedy) {
    found.push_back(context_.error(reason, std::move(message), std::move(remedy)));
  };
  if (sequences_.life().ends()) add(Reason::reloading, "it is being reloaded already", "wait for it");
  if (execution_.activity()) {
    const auto& command = execution_.activity()->command->value();
    add(execution_.activity()->state == AxisState::standstill ? Reason::busy : Reason::moving,
        fmt::format("executes {} {}{}", to_string(command.kind), command.id,
                    execution_.buffer().empty()
                        ? ""
                        : fmt::format(", and {} more wait for it", execution_.buffer().size())),
        "wait for its end, or stop it: " + context_.shell("stop"));
  } else if ((shaft_.sample() && shaft_.sample()->moving && !stopper_.machine().owed()) ||
             shaft_.terminal_motion().moves()) {
    add(Reason::moving, "the axis moves", "wait for standstill, or stop it: " + context_.shell("stop"));
  }
  if (stopper_.machine().coming()) add(Reason::stopping, "the axis is stopping", "wait for standstill");
  if (stopper_.machine().owed() && !stopper_.machine().under_way())
    add(Reason::stopping, "a stop is owed to the drive, which was not seen at rest",
        "look at the machine; the stop is the first that the drive gets when it answers");
  if (power_.machine().owes_release())
    add(Reason::busy, "the drive is being released, because a lease ended", "wait for it");
  if (work_.under_way() || work_.used())
    add(Reason::busy, "the drive's parameters, segments or memory are being worked on", "wait for it");
  if (earlier_.run().open())
    add(Reason::busy, "what became of a command of before the daemon's start is not known yet",
        "wait until the drive has been asked");
  // Nobody would look after a drive that is left, and one that stays is not configured under power (M1).
  if (shaft_.sample() && shaft_.sample()->enabled && (!energised || drift_.drifted()))
    add(Reason::busy,
        connection_.link().online() ? "its power stage is on"
                                    : "its power stage was on when it was last seen",
        connection_.link().online()
            ? "disable it first: " + context_.shell("disable")
            : "look at the machine and let the drive answer; or restart the service with this configuration");
  // The one that comes after would take it for energised since ever (M1).
  if (power_.machine().state() == PowerMachine::State::restarted && shaft_.sample() &&
      shaft_.sample()->enabled)
    add(Reason::busy, "its drive was switched off and on, and is energised",
        "enable or disable it first: " + context_.shell("enable"));
  if (execution_.fault())  // whoever comes after would know nothing of it
    add(Reason::fault, "in ErrorStop: " + execution_.fault()->message,
        "reset it first: " + context_.shell("reset"));
  return found;
}

void Axis::retire(bool position_holds) {
  sequences_.life().retire(!connection_.link().offline());
  connection_.link().explain(context_.reloading());
  if (context_.terminal_may_void_position() || !position_holds) readings_.lose_trust();
  if (!position_holds) saved_.void_saved_position();
  saved_.remember_position();
  // By the canary the axis that comes after it finds a restart of the drive, also where there is no position
  // (M1). A configuration that is under way may still write another one: then none is kept.
  const bool being_replaced = sequences_.life().answered() && !connection_.link().is_configured();
  if (shaft_.tracker().trust() == PositionTrust::unknown)
    being_replaced ? saved_.drop_canary() : saved_.keep_canary(PositionTrust::unknown);
  close();
  context_.env.bus->port_changed().notify_all();  // whoever waits for the port looks again
}

Result<std::shared_ptr<void>> Axis::use() {
  if (sequences_.life().retired()) return fail(context_.reloading());
  return work_.use();
}

}  // namespace axisd
