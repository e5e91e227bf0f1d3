"""Writes a CycloneDX bill of materials of the programs, from what cargo says:

    sbom.py OUT.json VERSION EPOCH TARGET METADATA.json TREE.txt Cargo.lock CRATE...

METADATA.json is of `cargo metadata`, which names more packages than are linked; TREE.txt is of `cargo
tree --edges normal --prefix none --format {p}`, which knows features exactly. The crates are those
of the programs. The file is checked against the schema of CycloneDX and is the same, byte for byte,
whenever and wherever it is made.
"""

import datetime
import json
import sys
import tomllib
import uuid

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model import ExternalReference, ExternalReferenceType, HashAlgorithm, HashType, XsUri
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL


def linked(metadata, tree, roots):
    """Packages of the tree, by id, each with those that it uses itself."""
    is_linked = {package["id"]: (package["name"], package["version"]) in tree for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    uses, ahead = {}, list(roots)
    while ahead:
        package = ahead.pop()
        if package not in uses:
            uses[package] = [
                needed["pkg"]
                for needed in nodes[package]["deps"]
                if is_linked[needed["pkg"]] and any(kind["kind"] is None for kind in needed["dep_kinds"])
            ]
            ahead += uses[package]
    return uses


def component(package, checksums):
    """A package; its checksum is that of the registry's archive."""
    name, version = package["name"], package["version"]
    purl = PackageURL("cargo", None, name, version)
    # Old manifests have a slash between licences to choose from.
    licence = (package["license"] or "").replace("/", " OR ")
    made = Component(
        type=ComponentType.LIBRARY,
        name=name,
        version=version,
        description=package["description"] and " ".join(package["description"].split()),
        purl=purl,
        bom_ref=purl.to_string(),
        licenses=[LicenseFactory().make_from_string(licence)] if licence else [],
    )
    if checksum := checksums.get((name, version)):
        made.hashes.add(HashType(alg=HashAlgorithm.SHA_256, content=checksum))
    if repository := package["repository"]:
        made.external_references.add(ExternalReference(type=ExternalReferenceType.VCS, url=XsUri(repository)))
    return made


def main(out, version, epoch, target, metadata, tree, lock, *crates):
    with open(metadata, encoding="utf-8") as file:
        metadata = json.load(file)
    with open(tree, encoding="utf-8") as file:
        tree = {(words[0], words[1].removeprefix("v")) for words in map(str.split, file) if words}
    with open(lock, "rb") as file:
        checksums = {
            (package["name"], package["version"]): package["checksum"]
            for package in tomllib.load(file)["package"]
            if "checksum" in package
        }
    packages = {package["id"]: package for package in metadata["packages"]}
    roots = [id for id, package in packages.items() if package["source"] is None and package["name"] in crates]
    if len(roots) != len(crates):
        sys.exit(f"sbom.py: not all of {', '.join(crates)} are among the packages")
    uses = linked(metadata, tree, roots)
    if missing := tree - {(packages[id]["name"], packages[id]["version"]) for id in uses}:
        sys.exit(f"sbom.py: not in the metadata: {sorted(missing)}")

    bom = Bom(serial_number=uuid.uuid5(uuid.NAMESPACE_URL, f"strandlight-{version}-{target}-{epoch}"))
    bom.metadata.timestamp = datetime.datetime.fromtimestamp(int(epoch), datetime.timezone.utc)
    programs = Component(type=ComponentType.APPLICATION, name="strandlight", version=version, bom_ref="strandlight")
    programs.licenses.add(LicenseFactory().make_from_string("MIT OR Apache-2.0"))
    bom.metadata.component = programs
    components = {id: component(packages[id], checksums) for id in sorted(uses)}
    bom.components.update(components.values())
    bom.register_dependency(programs, [components[id] for id in roots])
    for id, needed in uses.items():
        bom.register_dependency(components[id], [components[other] for other in needed])

    text = JsonV1Dot6(bom).output_as_string(indent=1)
    if error := JsonStrictValidator(SchemaVersion.V1_6).validate_str(text):
        sys.exit(f"sbom.py: {out}: {error}")
    with open(out, "w", encoding="utf-8") as file:
        file.write(text + "\n")
    print(f"sbom.py: {len(components)} packages", file=sys.stderr)


if __name__ == "__main__":
    if len(sys.argv) < 9:
        sys.exit(__doc__)
    main(*sys.argv[1:])
