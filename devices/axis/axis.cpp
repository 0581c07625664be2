#include "devices/axis/axis.hpp"

#include <utility>

namespace axisd {

Axis::Axis(AxisEnvironment environment, AxisSettings settings, const DriveDescriptor& descriptor,
           std::unique_ptr<Drive> drive, AxisFacePtr face, bool simulated)
    : context_(std::move(environment), std::move(settings), descriptor, std::move(drive), std::move(face),
               simulated),
      sequences_(context_),
      shaft_(context_),
      power_(context_, shaft_, stopper_, execution_, starts_, reader_, readings_, connection_, lease_, saved_,
             publisher_),
      connection_(context_, sequences_, shaft_, power_.machine(), stopper_, execution_, reader_, readings_,
                  drift_, work_, earlier_, saved_, publisher_),
      stopper_(context_, sequences_, shaft_, connection_, connection_.link(), reader_, readings_, execution_,
               saved_, publisher_),
      saved_(context_, shaft_, power_.machine(), sequences_.life()),
      drift_(context_, sequences_, shaft_, connection_.link(), connection_, work_, reader_, readings_,
             execution_, stopper_, publisher_),
      publisher_(context_, shaft_, connection_.link(), connection_.identity(), power_.machine(),
                 stopper_.machine(), drift_.watch(), execution_),
      execution_(context_, shaft_, stopper_.machine(), stopper_, publisher_, acceptance_),
      readings_(context_, shaft_, connection_.link(), power_.machine(), stopper_.machine(), stopper_,
                execution_, reader_, lease_, saved_, publisher_),
      reader_(context_, shaft_, connection_.link(), power_.machine(), stopper_, execution_, readings_,
              connection_, drift_, publisher_),
      work_(context_, shaft_, preconditions_, execution_, drift_),
      earlier_(context_, sequences_.life(), shaft_, power_.machine(), stopper_.machine(), execution_,
               readings_, publisher_),
      starts_(context_, shaft_, stopper_.machine(), execution_),
      preconditions_(context_, sequences_.life(), shaft_, connection_.link(), power_.machine(),
                     stopper_.machine(), drift_, work_, starts_, execution_),
      motion_(context_, shaft_, stopper_, execution_, starts_, reader_, readings_, connection_, power_,
              saved_, publisher_),
      homing_(context_, shaft_, stopper_.machine(), execution_, starts_, reader_, readings_, motion_, saved_),
      acceptance_(context_, sequences_, shaft_, stopper_.machine(), stopper_, execution_, preconditions_,
                  starts_, motion_, homing_, power_, publisher_),
      lease_(context_, shaft_, connection_.link(), power_.machine(), stopper_.machine(), stopper_, execution_,
             acceptance_, publisher_) {
  context_.drive->on_attention([this] { reader_.wake(); });
  context_.drive->ask_before_saving([this](std::uint64_t saves) { return publisher_.permit_saves(saves); });
  publisher_.publish();
}

Axis::~Axis() = default;

void Axis::start(bool answered) {
  if (answered) connection_.link().answers();
  earlier_.take_over();
  sequences_.launch(connection_.run(), "link");
}

void Axis::close() {
  // With what a start that was not sent has left in the drive. What moves comes to rest elsewhere.
  if (!sequences_.life().ends())
    saved_.keep_canary(execution_.at_rest() ? shaft_.tracker().trust() : PositionTrust::unknown);
  sequences_.life().close();
  connection_.link().close();
  execution_.supersede(context_.error(Reason::cancelled, "the daemon ends"));
  drift_.give_up_comparison();
  publisher_.publish();
  reader_.wake();
  for (auto* signal : {&shaft_.sampled(), &stopper_.stopped()}) signal->notify_all();
}

void Axis::take_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command) {
  acceptance_.take_stop(request, options, std::move(command));
}

Result<Plan> Axis::plan_member(const GroupMemberRequest& request, const CommandOptions& options) {
  return acceptance_.plan_member(request, options);
}

std::int64_t Axis::way_of(const Plan& plan) const {
  return plan.target.value().counter - shaft_.tracker().counter();
}

Result<CommandPtr> Axis::submit(const Action& action, const CommandOptions& options) {
  return acceptance_.submit(action, options);
}

std::vector<Obstacle> Axis::explain(const std::optional<Action>& action,
                                    const CommandOptions& options) const {
  return preconditions_.explain(action, options);
}

Result<CommandPtr> Axis::cancel(const CommandPtr& command, TimePoint arrived) {
  return acceptance_.cancel(command, arrived);
}

Result<void> Axis::check_lease(const Requester& requester) const {
  return preconditions_.check_lease(requester);
}

bool Axis::position_is_from_home() const { return context_.is_from_home(shaft_.tracker().offset()); }

}  // namespace axisd
