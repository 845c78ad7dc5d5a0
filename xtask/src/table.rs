//! Figures for people and for scripts.

use anyhow::Result;
use firmware::services::web::PAGE_SIZE;
use xtask::bench::{Goal, Row};
use xtask::board::Board;
use xtask::size::Size;

/// The firmware may take so much more than a bare program, in bytes.
const MOST_FLASH: u64 = 200_000;
const MOST_MEMORY: u64 = 64_000;

/// Prints flash and memory of each chip.
pub fn sizes(setup: bool) -> Result<()> {
    println!(
        "{:<10} {:<12} {:>12} {:>14}",
        "board", "program", "flash", "static memory"
    );
    for board in Board::CHIPS {
        let firmware = Size::of(&board.build(board.binary(), &[], setup)?)?;
        let bare = Size::of(&board.build("bare", &[], setup)?)?;
        let (flash, memory) = (
            firmware.flash.saturating_sub(bare.flash),
            firmware.memory.saturating_sub(bare.memory),
        );
        let row = |program: &str, flash: u64, memory: u64| {
            println!(
                "{:<10} {program:<12} {flash:>12} {memory:>14}",
                board.name()
            );
        };
        row("firmware", firmware.flash, firmware.memory);
        row("bare", bare.flash, bare.memory);
        row("overhead", flash, memory);
        row("at most", MOST_FLASH, MOST_MEMORY);
        if flash > MOST_FLASH || memory > MOST_MEMORY {
            println!("{:<10} MISSED", board.name());
        }
    }
    println!("{:<10} {:<12} {PAGE_SIZE:>12}", "each", "page");
    Ok(())
}

/// Prints the table of instructions.
pub fn bench(rows: &[Row], csv: bool) {
    if csv {
        println!("work,goal,measured,peer,peer_measured");
        for row in rows {
            let own = format!("{},{},{}", row.work, row.most(), row.measured);
            for (peer, count) in &row.peers {
                println!("{own},{peer},{count}");
            }
            if row.peers.is_empty() {
                println!("{own},,");
            }
        }
        return;
    }
    println!("instructions of riscv32imc\n");
    println!(
        "{:<20} {:>8} {:>9}  {:<7} beside it",
        "work", "goal", "measured", ""
    );
    for row in rows {
        let peers: Vec<String> = row
            .peers
            .iter()
            .map(|(peer, count)| format!("{peer} {count}"))
            .collect();
        let verdict = if row.is_met() { "met" } else { "MISSED" };
        let goal = match row.goal {
            Goal::Instructions(most) => most.to_string(),
            Goal::Times(factor) => format!("{factor} x"),
        };
        println!(
            "{:<20} {goal:>8} {:>9}  {verdict:<7} {}",
            row.work,
            row.measured,
            peers.join(", ")
        );
    }
}
