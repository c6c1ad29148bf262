//! `palpus devices --conformance`: tests whether a user's driver follows the bridge's protocol.

use std::process::ExitCode;

use palpus_device::{BridgeAddress, Check};
use serde_json::{Value, json};

use crate::output;

pub(super) fn conformance(address: &str, json: bool) -> anyhow::Result<ExitCode> {
    let address = BridgeAddress::parse(address)?;
    let checks = palpus_device::conformance(&address)?;
    let failed = checks.iter().filter(|check| check.outcome.is_err()).count();
    if json {
        output::json(&document(&address, &checks))?;
    } else {
        table(&checks).into_iter().for_each(output::line);
        output::line("");
        output::line(match failed {
            0 => format!("The driver at {address} conforms: palpus run --device bridge:{address}"),
            1 => format!(
                "The driver at {address} does not conform: correct the failed check; docs/bridge.md describes the protocol."
            ),
            more => format!(
                "The driver at {address} does not conform: {more} checks failed; docs/bridge.md describes the protocol."
            ),
        });
    }
    Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Returns a line for each check, and advice below each failed check.
fn table(checks: &[Check]) -> Vec<String> {
    let mut lines = Vec::new();
    for Check { name, outcome } in checks {
        match outcome {
            Ok(seen) => lines.push(format!("passed  {name} ({seen})")),
            Err(mend) => lines.extend([format!("FAILED  {name}"), format!("        mend: {mend}")]),
        }
    }
    lines
}

fn document(address: &BridgeAddress, checks: &[Check]) -> Value {
    let each = |Check { name, outcome }: &Check| match outcome {
        Ok(seen) => json!({ "check": name, "passed": true, "seen": seen }),
        Err(mend) => json!({ "check": name, "passed": false, "mend": mend }),
    };
    let passed = checks.iter().all(|check| check.outcome.is_ok());
    json!({ "address": address.to_string(), "passed": passed, "checks": checks.iter().map(each).collect::<Vec<_>>() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_check_names_the_remedy() {
        let check = |name, outcome| Check { name, outcome };
        let checks = [
            check("answers a hello", Ok("an arm, 5 N".to_owned())),
            check("goes to zero", Err("set the WITHHELD flag".to_owned())),
        ];
        let lines = table(&checks);
        assert_eq!(lines[0], "passed  answers a hello (an arm, 5 N)");
        assert_eq!(lines[1..], ["FAILED  goes to zero", "        mend: set the WITHHELD flag"]);
        let document = document(&BridgeAddress::Path("/a".into()), &checks);
        assert_eq!(document["passed"], false);
        assert_eq!(document["checks"][1]["mend"], "set the WITHHELD flag");
    }
}
