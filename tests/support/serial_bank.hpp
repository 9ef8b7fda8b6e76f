#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::test {

/// A bus of units with nothing but holding registers, as strict about its line as a motor driver:
/// 2000h registers, each of which reads as its own address at first; FC 03, 06, 08 and 10h with at
/// most 16 registers; broadcasts are carried out by all and answered by none.
class SerialBank final : public sim::Server {
 public:
  struct Options {
    std::vector<modbus::UnitId> units = {{1}};
    Duration gap = std::chrono::microseconds(5500);
    Duration delay = std::chrono::milliseconds(10);
  };

  explicit SerialBank(Options options) : options_(std::move(options)) {}

  std::optional<modbus::Pdu> answer(sim::ConnectionId /*connection*/, modbus::UnitId unit,
                                    const modbus::Pdu& request, TimePoint /*now*/) override {
    ++queries;
    if (unit == modbus::UnitId{}) {
      for (const modbus::UnitId each : options_.units) carry_out(each, request);
      return std::nullopt;
    }
    if (!answers_to(unit)) return std::nullopt;
    return carry_out(unit, request);
  }
  [[nodiscard]] bool answers_to(modbus::UnitId unit) const override {
    return std::find(options_.units.begin(), options_.units.end(), unit) != options_.units.end();
  }
  [[nodiscard]] Duration required_gap() const override { return options_.gap; }
  [[nodiscard]] Duration answer_delay(modbus::UnitId /*unit*/) const override {
    return options_.delay;
  }
  void bad_frame(TimePoint /*now*/) override { ++bad_frames; }
  void advance(TimePoint /*now*/) override {}
  [[nodiscard]] std::optional<TimePoint> next_change() const override { return std::nullopt; }
  std::vector<sim::Push> take_pushes() override { return {}; }
  void connected(sim::ConnectionId /*connection*/) override {}
  void disconnected(sim::ConnectionId /*connection*/) override {}

  [[nodiscard]] std::uint16_t word(modbus::UnitId unit, std::uint16_t address) const {
    const auto found = written_.find({unit.value, address});
    return found == written_.end() ? address : found->second;
  }

  int queries = 0;
  int bad_frames = 0;

 private:
  static constexpr std::uint32_t end_of_registers = 0x2000;
  static constexpr std::size_t most_registers = 16;

  static bool exist(modbus::RegisterAddress first, std::size_t count) {
    return first.value + count <= end_of_registers;
  }

  modbus::Pdu carry_out(modbus::UnitId unit, const modbus::Pdu& request) {
    using modbus::ExceptionCode;
    const auto refuse = [&](ExceptionCode code) {
      return modbus::exception_response(request.function, static_cast<std::uint8_t>(code));
    };
    const auto parsed = modbus::parse_request(request);
    if (!parsed) return refuse(parsed.error());
    if (const auto* read = std::get_if<modbus::ReadRequest>(&*parsed)) {
      if (read->table != modbus::RegisterTable::holding)
        return refuse(ExceptionCode::illegal_function);
      if (read->count > most_registers) return refuse(ExceptionCode::illegal_data_value);
      if (!exist(read->first, read->count)) return refuse(ExceptionCode::illegal_data_address);
      Registers words;
      for (std::uint16_t at = 0; at < read->count; ++at)
        words.push_back(word(unit, static_cast<std::uint16_t>(read->first.value + at)));
      return modbus::read_response(read->table, words);
    }
    if (const auto* write = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
      if (!exist(write->address, 1)) return refuse(ExceptionCode::illegal_data_address);
      written_[{unit.value, write->address.value}] = write->value;
      return request;
    }
    if (const auto* write = std::get_if<modbus::WriteMultipleRequest>(&*parsed)) {
      if (write->values.size() > most_registers) return refuse(ExceptionCode::illegal_data_value);
      if (!exist(write->first, write->values.size()))
        return refuse(ExceptionCode::illegal_data_address);
      auto address = write->first.value;
      for (const std::uint16_t value : write->values) written_[{unit.value, address++}] = value;
      return modbus::write_multiple_response(write->first,
                                             static_cast<std::uint16_t>(write->values.size()));
    }
    if (request.function == static_cast<std::uint8_t>(modbus::FunctionCode::diagnostics))
      return request;
    return refuse(ExceptionCode::illegal_function);
  }

  Options options_;
  std::map<std::pair<std::uint8_t, std::uint16_t>, std::uint16_t> written_ = {};
};

}  // namespace spindle::test
