#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"

namespace spindle::posix {

/// Takes the numbers of those standard streams that are closed, so that no socket or serial line
/// gets one and hears what is meant for people. False when that can not be done. To be called
/// before anything is opened.
bool hold_standard_descriptors();

/// Writes everything to standard output; `closed_pipe` when its reader is gone, `storage` (with the
/// system's words) on any other failure, such as a full disk: then a file has nothing of it. Waits
/// for a slow reader, and restarts after signals.
Result<void> write_out(std::string_view text);

/// Writes everything to standard error; failures are ignored, there is nobody left to tell.
void write_err(std::string_view text);

/// Reads one line of standard input, without its end; empty at end of input and when an interrupt
/// was raised, before or during the wait.
std::function<std::optional<std::string>()> line_reader(const Clock& clock,
                                                        const Interrupt& interrupt);

/// Whether the reader of standard output is still there. Only pipes and sockets can tell; others
/// are always open.
bool out_is_open();

/// Whether standard output is a file that ends within a line, which a crash or a full disk cut off.
bool out_ends_within_line();

/// Whether standard error takes a line (of at most 4096 bytes) without waiting: not when its pipe
/// is full or its terminal was halted with Ctrl-S.
bool err_is_ready();

/// Cells of a row of the terminal behind standard error; 0 when it is none, or does not say.
std::size_t err_columns();

/// The standard streams.
enum class Std : std::uint8_t { in, out, err };
bool is_terminal(Std stream);

}  // namespace spindle::posix
