// What a drive's registers and objects may hold: an exchange can be sound, and what it carries nonsense.
#include <array>
#include <vector>

#include "devices/cia402/encoding.hpp"
#include "devices/cia402/unit_objects.hpp"
#include "devices/generic/value.hpp"
#include "devices/yako_rtu/codec.hpp"
#include "devices/yss_c/model.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

void registers(Input& input) {
  std::array<std::uint16_t, yako_rtu::state_count> state{};
  for (auto& word : state) word = input.word();
  (void)yako_rtu::decode_state(state);
  yako_rtu::MotionBlock block{};
  for (auto& word : block) word = input.word();
  (void)yako_rtu::target_of(block);
  expect(yako_rtu::exception_text(input.word()) != nullptr, "each code has a text");
}

std::int64_t number(Input& input) {
  const std::uint64_t high = input.word();
  return static_cast<std::int64_t>(high << 48U | std::uint64_t{input.word()} << 32U |
                                   std::uint64_t{input.word()} << 16U | input.word());
}

void objects(Input& input) {
  const auto& model = yss_c::model();
  const std::int64_t pulses = 1 + input.word();
  cia402::Values values;
  const auto hold = [&](canopen::Object object) {
    // As read_values() gives them: no wider than the object is.
    const auto type = cia402::type_of(model, object);
    const auto bits = 64 - 8 * type.bytes;
    const auto raw = static_cast<std::uint64_t>(number(input)) << bits;
    values[object.key()] =
        type.is_signed ? static_cast<std::int64_t>(raw) >> bits : static_cast<std::int64_t>(raw >> bits);
  };
  for (const auto object : cia402::state_objects(model)) hold(object);
  (void)cia402::decode_state(model, pulses, values, {.inputs = input.byte(), .outputs = input.byte()},
                             input.byte() % 2);
  (void)cia402::told_motion(model, values, input.byte() % 2 == 0);
  (void)cia402::home_bit(model, values);
  (void)cia402::homing_failed(model, values);
  (void)cia402::alarm_of(model, input.word());
  for (const auto object : cia402::unit_objects())
    if (input.byte() % 2 != 0) hold(object);
  (void)cia402::told_velocity(values);
  (void)cia402::told_acceleration(values);
  if (const auto told = cia402::told_revolution(values)) (void)told->fits(pulses);
  if (const auto conflict = cia402::find_conflict({}, pulses, values))
    expect(!conflict->message.empty() && !conflict->remedy.empty(), "a contradiction is told");
}

}  // namespace

void run(Input input) {
  if (input.byte() % 2 == 0)
    registers(input);
  else
    objects(input);
  const std::array two{input.word(), input.word()};
  const auto raw = from_registers(two);
  expect(raw == (std::uint32_t{two[0]} << 16U | two[1]), "two registers are a number");
}

}  // namespace axisd::fuzz
