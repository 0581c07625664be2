#include "devices/axis/terminal_motion.hpp"

namespace axisd {

TerminalMotion::Verdict TerminalMotion::judge(const Motion& motion) {
  if (moves()) return Verdict::known;
  if (motion.told_to_stop) return Verdict::nobodys;
  if (motion.terminals_start && motion.just_began && !motion.shown) return Verdict::look_again;
  if (!motion.shown && !motion.by_itself) return Verdict::nobodys;
  state_ = State::by_terminal;
  return Verdict::begins;
}

}  // namespace axisd
