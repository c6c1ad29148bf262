#!/usr/bin/env python3
"""Lists the components of the released files: licence texts of all dependencies, and a CycloneDX list of components (SBOM).

    packaging/inventory.py FOLDER PACKAGE…

writes FOLDER/THIRD-PARTY-LICENCES.txt and FOLDER/sbom.cdx.json for these packages of the workspace, from `cargo metadata`
and the sources in cargo's registry. Development and build dependencies are left out, because they are not in the released files.
"""

import json
import pathlib
import subprocess
import sys
from typing import Any

# The licences of fonts are in subfolders.
PATTERNS = ("LICENSE*", "LICENCE*", "COPYING*", "COPYRIGHT*", "NOTICE*", "UNLICENSE*", "**/OFL*", "**/UFL*")


def metadata() -> dict[str, Any]:
    host = next(
        line.split()[1]
        for line in subprocess.run(["rustc", "-vV"], check=True, capture_output=True, text=True).stdout.splitlines()
        if line.startswith("host:")
    )
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", host]
    result: dict[str, Any] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return result


def reached(about: dict[str, Any], names: list[str]) -> list[dict[str, Any]]:
    """Returns the packages in the released files, by name and version."""
    packages = {package["id"]: package for package in about["packages"]}
    nodes = {node["id"]: node for node in about["resolve"]["nodes"]}
    wanted = [id for id in about["workspace_members"] if packages[id]["name"] in names]
    if len(wanted) < len(names):
        sys.exit(f"error: not all of {', '.join(names)} are packages of the workspace")
    seen = set(wanted)
    while wanted:
        for dependency in nodes[wanted.pop()]["deps"]:
            is_normal = any(kind["kind"] is None for kind in dependency["dep_kinds"])
            if is_normal and dependency["pkg"] not in seen:
                seen.add(dependency["pkg"])
                wanted.append(dependency["pkg"])
    return sorted((packages[id] for id in seen), key=lambda package: (package["name"], package["version"]))


def licences(packages: list[dict[str, Any]]) -> str:
    """Returns one text for each distinct licence file, with the packages that have it."""
    texts: dict[str, list[str]] = {}
    without = []
    for package in packages:
        folder = pathlib.Path(package["manifest_path"]).parent
        files = sorted({file for pattern in PATTERNS for file in folder.glob(pattern) if file.is_file()})
        name = f"{package['name']} {package['version']} ({package['license'] or 'see its text'})"
        if not files:
            without.append(name)
        for file in files:
            texts.setdefault(file.read_text(errors="replace").strip(), []).append(f"{name}, {file.name}")
    parts = ["palpus is built from the packages below. Each text follows the names of its packages."]
    parts += ["\n".join(names) + "\n\n" + text for text, names in texts.items()]
    if without:
        parts.append("Packages without a text of their own, under the licences named here:\n" + "\n".join(without))
    return ("\n\n" + "=" * 100 + "\n\n").join(parts) + "\n"


def components(packages: list[dict[str, Any]], checksums: dict[tuple[str, str], str]) -> dict[str, Any]:
    """Returns the SBOM in the format CycloneDX 1.5."""
    listed = []
    for package in packages:
        if package["source"] is None:
            continue
        name, version = package["name"], package["version"]
        component: dict[str, Any] = {
            "type": "library",
            "name": name,
            "version": version,
            "purl": f"pkg:cargo/{name}@{version}",
            "bom-ref": f"pkg:cargo/{name}@{version}",
        }
        if package["license"]:
            component["licenses"] = [{"expression": package["license"].replace("/", " OR ")}]
        if (name, version) in checksums:
            component["hashes"] = [{"alg": "SHA-256", "content": checksums[name, version]}]
        listed.append(component)
    own = next(package for package in packages if package["source"] is None)
    about = {"component": {"type": "application", "name": "palpus", "version": own["version"]}}
    return {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1, "metadata": about, "components": listed}


def locked(root: pathlib.Path) -> dict[tuple[str, str], str]:
    """Returns the checksums of the registry's packages."""
    import tomllib

    packages = tomllib.loads((root / "Cargo.lock").read_text())["package"]
    return {(entry["name"], entry["version"]): entry["checksum"] for entry in packages if "checksum" in entry}


def main() -> None:
    if len(sys.argv) < 3:
        sys.exit("use: packaging/inventory.py FOLDER PACKAGE…")
    folder = pathlib.Path(sys.argv[1])
    about = metadata()
    packages = reached(about, sys.argv[2:])
    third = [package for package in packages if package["source"] is not None]
    (folder / "THIRD-PARTY-LICENCES.txt").write_text(licences(third))
    sbom = components(packages, locked(pathlib.Path(about["workspace_root"])))
    (folder / "sbom.cdx.json").write_text(json.dumps(sbom, indent=1) + "\n")
    print(f"{len(third)} packages of others")


main()
