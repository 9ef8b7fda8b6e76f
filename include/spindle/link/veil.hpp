#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "spindle/link/register_range.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::link {

/// Keeps registers that are secret out of what is shown and kept of the frames of one connection:
/// they stand there as 0. Knows an answer by what was asked before, so it has to see every request.
class Veil {
 public:
  /// From now on these are secret.
  void hide(std::vector<RegisterRange> secrets) { secrets_ = std::move(secrets); }

  /// A request as it may be shown. Its answers are known from then on.
  Bytes request(modbus::Framing framing, const modbus::Adu& adu);

  /// What may be shown of bytes that came, and of those that were kept back before. Once a secret
  /// was asked for or written, only whole frames are.
  Bytes received(modbus::Framing framing, ByteView bytes);

  /// What was kept back and never became a frame, all of it as 0.
  Bytes rest();

  [[nodiscard]] modbus::Pdu request(modbus::Pdu pdu) const;
  /// A response, or what came instead of one.
  [[nodiscard]] modbus::Pdu response(modbus::Pdu pdu) const;

  /// Whether a secret was asked for or written, so that bytes that are no whole frame must not be
  /// shown.
  [[nodiscard]] bool is_drawn() const { return is_drawn_; }

 private:
  [[nodiscard]] bool hides(modbus::RegisterTable table, std::uint32_t address) const;
  [[nodiscard]] bool touches(const RegisterRange& range) const;
  void note(const modbus::Pdu& pdu);
  void cover(const RegisterRange& range, Bytes& data, std::size_t at) const;

  std::vector<RegisterRange> secrets_ = {};
  std::deque<RegisterRange> asked_ = {};  ///< reads of secrets, as late answers to them may come
  bool is_awaited_ = false;               ///< the last request was one of them
  bool is_drawn_ = false;
  Bytes held_ = {};
};

}  // namespace spindle::link
