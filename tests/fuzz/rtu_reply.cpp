// What a node on an RS-485 line may answer. The first bytes choose the request, the rest is the reply.
#include <algorithm>

#include "buses/modbus_rtu/frame.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

using modbus_rtu::Function;

modbus_rtu::Request request_of(Input& input) {
  constexpr Function functions[] = {Function::read_holding_registers, Function::write_single_register,
                                    Function::write_multiple_registers};
  modbus_rtu::Request request{.node = input.byte(), .function = functions[input.byte() % 3U]};
  request.address = input.word();
  request.count = static_cast<std::uint16_t>(input.byte() % 130U);
  if (request.function == Function::read_holding_registers) return request;
  if (request.function == Function::write_single_register) request.count = 1;
  request.values.resize(request.count, request.address);
  return request;
}

}  // namespace

void run(Input input) {
  const auto request = request_of(input);
  if (!modbus_rtu::encode(request)) return;
  auto reply = input.rest();
  reply = reply.first(std::min(reply.size(), modbus_rtu::Frame::capacity));
  if (reply.size() >= 3) (void)modbus_rtu::reply_size(reply);
  const auto decoded = modbus_rtu::decode(request, reply);
  const auto registers = modbus_rtu::Registers(modbus_rtu::Frame(reply)).values().size();
  if (decoded.kind == modbus_rtu::ReplyKind::match && request.function == Function::read_holding_registers)
    expect(registers == request.count, "a reply that matches has what was asked for");
}

}  // namespace axisd::fuzz
