#pragma once

#include <tuple>

#include "spindle/catalogue/profile.hpp"

namespace spindle::catalogue {

// The members of every structure of a profile, in their order. A structure that gets another member
// does not compile here, so that no table and no comparison forgets it.

template <typename First, typename Second>
auto fields(const Entry<First, Second>& entry) {
  return std::tie(entry.key, entry.value);
}

inline auto fields(const modbus::RegisterAddress& address) { return std::tie(address.value); }

inline auto fields(const BitSlice& v) {
  const auto& [first, width] = v;
  return std::tie(first, width);
}

inline auto fields(const Encoding& v) {
  const auto& [kind, scale, divisor, offset, decimals, length, count, slice, word_order, byte_order,
               padding, packing, date] = v;
  return std::tie(kind, scale, divisor, offset, decimals, length, count, slice, word_order,
                  byte_order, padding, packing, date);
}

inline auto fields(const Label& v) {
  const auto& [number, text] = v;
  return std::tie(number, text);
}

inline auto fields(const Range& v) {
  const auto& [minimum, maximum] = v;
  return std::tie(minimum, maximum);
}

inline auto fields(const BitName& v) {
  const auto& [bit, text, when, width] = v;
  return std::tie(bit, text, when, width);
}

inline auto fields(const Parameter& v) {
  const auto& [name, title, table, address, encoding, unit, range, except, default_value, labels,
               bits, bits_by, part, notation, access, cloning, secrecy, guarding, reading, evidence,
               source, note, effect, risk, settle, hazard, nulls, scale_by, write_address, before,
               after] = v;
  return std::tie(name, title, table, address, encoding, unit, range, except, default_value, labels,
                  bits, bits_by, part, notation, access, cloning, secrecy, guarding, reading,
                  evidence, source, note, effect, risk, settle, hazard, nulls, scale_by,
                  write_address, before, after);
}

inline auto fields(const Slice& v) {
  const auto& [offset, size] = v;
  return std::tie(offset, size);
}

inline auto fields(const FirmwareCaution& v) {
  const auto& [from, to, text] = v;
  return std::tie(from, to, text);
}

inline auto fields(const IdentitySpec& v) {
  const auto& [minimum_bytes, id, controller_model, tool_model, firmware, serial, long_serial_bytes,
               long_serial, product_byte, products, total_bytes, total, models, firmware_from,
               firmware_below, cautions, model_from, serial_from, version_from] = v;
  return std::tie(minimum_bytes, id, controller_model, tool_model, firmware, serial,
                  long_serial_bytes, long_serial, product_byte, products, total_bytes, total,
                  models, firmware_from, firmware_below, cautions, model_from, serial_from,
                  version_from);
}

inline auto fields(const Area& v) {
  const auto& [table, from, to, note] = v;
  return std::tie(table, from, to, note);
}

inline auto fields(const UnaskedFrame& v) {
  const auto& [function, count] = v;
  return std::tie(function, count);
}

inline auto fields(const GapRule& v) {
  const auto& [up_to_baud, gap] = v;
  return std::tie(up_to_baud, gap);
}

inline auto fields(const modbus::SerialSettings& v) {
  const auto& [baud, parity, stop_bits] = v;
  return std::tie(baud, parity, stop_bits);
}

inline auto fields(const SerialSpec& v) {
  const auto& [line, gaps, broadcast_pause] = v;
  return std::tie(line, gaps, broadcast_pause);
}

inline auto fields(const UnitRange& v) {
  const auto& [first, last] = v;
  return std::tie(first, last);
}

inline auto fields(const LinkSpec& v) {
  const auto& [framing, port, unit, transactions, units, max_read, max_write, max_read_bits,
               write_function, max_gap, busy, busy_every, busy_limit, keep_alive, answer, connect,
               retries, settle, loopback, any_unit, word_order, byte_order, even_pairs, serial,
               contiguous, absent, unasked] = v;
  return std::tie(framing, port, unit, transactions, units, max_read, max_write, max_read_bits,
                  write_function, max_gap, busy, busy_every, busy_limit, keep_alive, answer,
                  connect, retries, settle, loopback, any_unit, word_order, byte_order, even_pairs,
                  serial, contiguous, absent, unasked);
}

inline auto fields(const Arming& v) {
  const auto& [address, value, disarm, every, expires] = v;
  return std::tie(address, value, disarm, every, expires);
}

inline auto fields(const EventColumn& v) {
  const auto& [heading, parameter, width] = v;
  return std::tie(heading, parameter, width);
}

inline auto fields(const EventSetting& v) {
  const auto& [is, parameter] = v;
  return std::tie(is, parameter);
}

inline auto fields(const EventForm& v) {
  const auto& [count, parameters, firmware_from] = v;
  return std::tie(count, parameters, firmware_from);
}

inline auto fields(const EventFrame& v) {
  const auto& [function, holds] = v;
  return std::tie(function, holds);
}

inline auto fields(const CurveChannel& v) {
  const auto& [type, count] = v;
  return std::tie(type, count);
}

inline auto fields(const CurveType& v) {
  const auto& [number, is, unit] = v;
  return std::tie(number, is, unit);
}

inline auto fields(const CurveSpec& v) {
  const auto& [channels, types, sampling, most, steps, first_step, step_types] = v;
  return std::tie(channels, types, sampling, most, steps, first_step, step_types);
}

inline auto fields(const BlockSearch& v) {
  const auto& [name, title, count, from, to, step] = v;
  return std::tie(name, title, count, from, to, step);
}

inline auto fields(const LearnedAction& v) {
  const auto& [name, title, follows, by, deed, minimum, maximum, labels, hazard, check] = v;
  return std::tie(name, title, follows, by, deed, minimum, maximum, labels, hazard, check);
}

inline auto fields(const LearnSpec& v) {
  const auto& [table, from, to, actions] = v;
  return std::tie(table, from, to, actions);
}

inline auto fields(const DiscoverySpec& v) {
  const auto& [group, port, ask, answer, bytes, every, serial, model, address, tool_port, mac,
               firmware, in_use, kind, kinds] = v;
  return std::tie(group, port, ask, answer, bytes, every, serial, model, address, tool_port, mac,
                  firmware, in_use, kind, kinds);
}

inline auto fields(const EventSpec& v) {
  const auto& [model, arm, function, first, count, number, flag, kind, kinds, error, columns,
               interval, preset, settings, longer, frames, identity, unit, curves, members,
               search] = v;
  return std::tie(model, arm, function, first, count, number, flag, kind, kinds, error, columns,
                  interval, preset, settings, longer, frames, identity, unit, curves, members,
                  search);
}

inline auto fields(const LimitSpec& v) {
  const auto& [minimum_offset, maximum_offset, from, to] = v;
  return std::tie(minimum_offset, maximum_offset, from, to);
}

inline auto fields(const NumberedSpec& v) {
  const auto& [prefix, table, from, to, access, evidence, source] = v;
  return std::tie(prefix, table, from, to, access, evidence, source);
}

inline auto fields(const Preparation& v) {
  const auto& [address, clear] = v;
  return std::tie(address, clear);
}

inline auto fields(const Action& v) {
  const auto& [name, title, table, address, encoding, value, stop_value, minimum, maximum,
               has_range, labels, motion, rest, prepare, busy, hazard, evidence, source, note,
               tells, effects, check, confirm, confirm_value] = v;
  return std::tie(name, title, table, address, encoding, value, stop_value, minimum, maximum,
                  has_range, labels, motion, rest, prepare, busy, hazard, evidence, source, note,
                  tells, effects, check, confirm, confirm_value);
}

inline auto fields(const CodeText& v) {
  const auto& [text, remedy, evidence, source, resettable, completed] = v;
  return std::tie(text, remedy, evidence, source, resettable, completed);
}

inline auto fields(const CodeTables& v) {
  const auto& [error, warning] = v;
  return std::tie(error, warning);
}

inline auto fields(const ExtendedErrorSpec& v) {
  const auto& [parameter, codes, busy, retry_every, give_up_after] = v;
  return std::tie(parameter, codes, busy, retry_every, give_up_after);
}

inline auto fields(const AlarmList& v) {
  const auto& [name, parameters, codes] = v;
  return std::tie(name, parameters, codes);
}

inline auto fields(const SimulationSpec::Value& v) {
  const auto& [pattern, raw] = v;
  return std::tie(pattern, raw);
}

inline auto fields(const SimulationSpec::Limits& v) {
  const auto& [pattern, minimum, maximum] = v;
  return std::tie(pattern, minimum, maximum);
}

inline auto fields(const SimulationSpec::Event& v) {
  const auto& [kind, values] = v;
  return std::tie(kind, values);
}

inline auto fields(const SimulationSpec& v) {
  const auto& [identity, identity_bytes, limit_exception, stopped_error, permanent_alarms, values,
               limits, events, absent] = v;
  return std::tie(identity, identity_bytes, limit_exception, stopped_error, permanent_alarms,
                  values, limits, events, absent);
}

inline auto fields(const RunWords& v) {
  const auto& [forward, reverse, decelerate, instant] = v;
  return std::tie(forward, reverse, decelerate, instant);
}

inline auto fields(const InputFunction& v) {
  const auto& [number, bit, evidence, source] = v;
  return std::tie(number, bit, evidence, source);
}

inline auto fields(const InputSpec& v) {
  const auto& [parameter, first, last, functions] = v;
  return std::tie(parameter, first, last, functions);
}

inline auto fields(const MonitorSpec& v) {
  const auto& [status, running, running_values, stopped_values, at_speed, busy, command_speed,
               feedback_speed, load, alarm, warning] = v;
  return std::tie(status, running, running_values, stopped_values, at_speed, busy, command_speed,
                  feedback_speed, load, alarm, warning);
}

inline auto fields(const StartOption& v) {
  const auto& [option, action] = v;
  return std::tie(option, action);
}

inline auto fields(const StartActionSpec& v) {
  const auto& [start, selections, alarm] = v;
  return std::tie(start, selections, alarm);
}

inline auto fields(const CommandWordSpec& v) {
  const auto& [command, mode, modes, starting, decelerate_always, instant_always, select, inputs,
               monitor, speed, acceleration, deceleration, first, last, preferred, analog, digital,
               analog_to, watchdog, group] = v;
  return std::tie(command, mode, modes, starting, decelerate_always, instant_always, select, inputs,
                  monitor, speed, acceleration, deceleration, first, last, preferred, analog,
                  digital, analog_to, watchdog, group);
}

inline auto fields(const EnableSpec& v) {
  const auto& [parameter, bit, value] = v;
  return std::tie(parameter, bit, value);
}

inline auto fields(const CommandRegisterSpec& v) {
  const auto& [command, forward, reverse, stop, instant, stop_register, stop_value, enable,
               set_point, monitor, stopping] = v;
  return std::tie(command, forward, reverse, stop, instant, stop_register, stop_value, enable,
                  set_point, monitor, stopping);
}

inline auto fields(const RunSpec& v) {
  const auto& [model, still_runs, evidence, source, is_derived] = v;
  return std::tie(model, still_runs, evidence, source, is_derived);
}

inline auto fields(const UnlockSpec& v) {
  const auto& [parameter, value, needed_by] = v;
  return std::tie(parameter, value, needed_by);
}

inline auto fields(const Profile& v) {
  const auto& [id, title, maker, series, path, bases, link, identity, events, limits, numbered,
               parameters, actions, exceptions, run, refusals, alarm_lists, alarm_reset, watched,
               unlock, writes, torque_unit_from, discovery, learn] = v;
  return std::tie(id, title, maker, series, path, bases, link, identity, events, limits, numbered,
                  parameters, actions, exceptions, run, refusals, alarm_lists, alarm_reset, watched,
                  unlock, writes, torque_unit_from, discovery, learn);
}

template <typename T>
concept Structure = requires(const T& value) {
  fields(value);
};

}  // namespace spindle::catalogue
