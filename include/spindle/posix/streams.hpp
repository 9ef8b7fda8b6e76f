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
/// gets one and hears what is meant for people. False when that cannot be done. To be called
/// before anything is opened.
bool hold_standard_descriptors();

/// Writes everything to standard output; `closed_pipe` when its reader is gone, `storage` (with the
/// system's words) on any other failure, such as a full disk: then a file has nothing of it. Waits
/// for a slow reader, and restarts after signals.
Result<void> write_out(std::string_view text);

/// Writes what the reader of standard output takes within `patience`, at most 4096 bytes at a time,
/// and returns how many bytes; 0 when it takes nothing. A file takes all of it, as ever. Fails as
/// write_out() does. Never waits longer, as long as no other program writes to the same pipe.
Result<std::size_t> write_out_for(std::string_view text, Duration patience);

/// Writes everything to standard error; failures are ignored, there is no other way to tell.
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

/// Whether standard error goes to the system's journal: JOURNAL_STREAM names its device and inode
/// (systemd.exec(5)), which a stream that was turned elsewhere has not.
bool err_is_journal();

/// Cells of a row of the terminal behind standard error; 0 when it is none, or does not say.
std::size_t err_columns();
/// Rows of the same terminal; 0 likewise.
std::size_t err_rows();
/// Cells of a row of the terminal behind standard output; 0 likewise.
std::size_t out_columns();

/// The standard streams.
enum class Std : std::uint8_t { in, out, err };
bool is_terminal(Std stream);

/// All of them, as the aggregate that its user has for them.
template <typename Streams>
Streams standard_streams(const Clock& clock, const Interrupt& interrupt) {
  return {.out = write_out,
          .err = write_err,
          .read_line = line_reader(clock, interrupt),
          .in_is_terminal = is_terminal(Std::in),
          .out_is_terminal = is_terminal(Std::out),
          .err_is_terminal = is_terminal(Std::err),
          .out_is_open = out_is_open,
          .err_is_ready = err_is_ready,
          .err_columns = err_columns,
          .err_rows = err_rows,
          .out_columns = out_columns,
          .out_ends_within_line = out_ends_within_line,
          .out_for = write_out_for,
          .err_is_journal = err_is_journal()};
}

}  // namespace spindle::posix
