//! What is served to arms: images, signed.

use anyhow::{Context, Result, ensure};
use ed25519_dalek::{Signer, SigningKey, VerifyingKey};
use protocol_core::update::{ImageName, Unverified, Version, hexadecimal};
use sha2::{Digest, Sha256};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The key of development builds, published on purpose.
pub const DEVELOPMENT_KEY: &str = "firmware/keys/development.key";

/// Makes a key: `FILE`, for its owner's eyes only, and `FILE.pub`, its public half. Gives the public half.
///
/// # Errors
/// When one of the files exists already: a key is never overwritten.
pub fn keygen(file: &Path) -> Result<String> {
    let mut secret = [0; 32];
    getrandom::fill(&mut secret).context("this computer gives no random numbers")?;
    let key = SigningKey::from_bytes(&secret);
    let public = hex(key.verifying_key().as_bytes());
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    let mut open_public = options.clone();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    write(&options, file, &hex(&secret))?;
    open_public.write(true);
    write(&open_public, &public_file(file), &public)?;
    Ok(public)
}

/// The public half of a key.
pub fn public_file(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".pub");
    name.into()
}

fn write(options: &OpenOptions, file: &Path, line: &str) -> Result<()> {
    let named = || file.display().to_string();
    let mut file = options.open(file).with_context(named)?;
    writeln!(file, "{line}").with_context(named)
}

/// A key that was made before.
pub fn read_key(file: &Path) -> Result<SigningKey> {
    let text = fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let secret = hexadecimal(text.trim().as_bytes())
        .with_context(|| format!("{} is not a key", file.display()))?;
    Ok(SigningKey::from_bytes(&secret))
}

/// The manifest of an image that will lie beside it under that name.
pub fn manifest(
    board: &str,
    version: Version,
    name: &str,
    image: &[u8],
    key: &SigningKey,
) -> Result<String> {
    let name = ImageName::new(name)
        .context("an image's name is letters, digits and . _ - +, 64 at most")?;
    let signed = format!(
        "Quill update 1\nboard: {board}\nversion: {version}\nsize: {}\nsha256: {}\nimage: {}\n",
        image.len(),
        hex(&Sha256::digest(image)),
        name.as_str(),
    );
    let signature = key.sign(signed.as_bytes());
    let manifest = format!("{signed}signature: {}\n", hex(&signature.to_bytes()));
    verify(&manifest, &key.verifying_key())?;
    Ok(manifest)
}

/// Reads it as an arm does.
fn verify(manifest: &str, key: &VerifyingKey) -> Result<()> {
    let read = Unverified::parse(manifest.as_bytes()).and_then(|unverified| {
        unverified.verify(|signature, signed| {
            let signature = ed25519_dalek::Signature::from_bytes(signature);
            key.verify_strict(signed, &signature).is_ok()
        })
    });
    match read {
        Ok(_) => Ok(()),
        Err(rejection) => anyhow::bail!("an arm would refuse the manifest: {rejection}"),
    }
}

/// Image, manifest and checksums of a release, in `folder`: what a web server has to serve; and manifest and
/// image in one file, for an arm's page. Gives the manifest's file.
pub fn release(
    board: &str,
    version: Version,
    image: &[u8],
    key: &SigningKey,
    folder: &Path,
) -> Result<PathBuf> {
    let image_name = format!("quill-{version}-{board}.bin");
    let text_name = format!("{board}.txt");
    let one_name = format!("quill-{version}-{board}.update");
    let text = manifest(board, version, &image_name, image, key)?;
    let one = [text.as_bytes(), image].concat();
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let put = |name: &str, content: &[u8]| {
        let file = folder.join(name);
        fs::write(&file, content).with_context(|| file.display().to_string())?;
        Ok::<_, anyhow::Error>(file)
    };
    let mut sums = String::new();
    for (name, content) in [
        (&image_name, image),
        (&text_name, text.as_bytes()),
        (&one_name, &one),
    ] {
        put(name, content)?;
        sums += &format!("{}  {name}\n", hex(&Sha256::digest(content)));
    }
    put(&format!("{board}.sha256"), sums.as_bytes())?;
    Ok(folder.join(text_name))
}

/// That a key is the one built into the firmware: `QUILL_UPDATE_KEY` of this environment, or the
/// development key.
pub fn ensure_built_in(key: &SigningKey, root: &Path) -> Result<()> {
    let built_in = match std::env::var("QUILL_UPDATE_KEY") {
        Ok(digits) => digits,
        Err(_) => hex(read_key(&root.join(DEVELOPMENT_KEY))?
            .verifying_key()
            .as_bytes()),
    };
    ensure!(
        built_in.trim() == hex(key.verifying_key().as_bytes()),
        "the firmware would believe another key: set QUILL_UPDATE_KEY to the public half of this one"
    );
    Ok(())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use protocol_core::update::manifest_end;

    #[test]
    fn a_key_is_made_once_and_for_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("my.key");
        let public = keygen(&file).unwrap();
        let text = fs::read_to_string(public_file(&file)).unwrap();
        assert_eq!(text.trim(), public);
        let key = read_key(&file).unwrap();
        assert_eq!(hex(key.verifying_key().as_bytes()), public);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = fs::metadata(&file).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
        assert!(keygen(&file).is_err(), "a key was overwritten");
        assert_eq!(read_key(&file).unwrap().to_bytes(), key.to_bytes());
    }

    #[test]
    fn a_release_is_what_an_arm_takes() {
        let folder = tempfile::tempdir().unwrap();
        let key = SigningKey::from_bytes(&[3; 32]);
        let image = vec![0x5a; 5000];
        let version = Version::new(0, 2, 0);
        let place = release("virt", version, &image, &key, folder.path()).unwrap();
        let text = fs::read_to_string(place).unwrap();
        let unverified = Unverified::parse(text.as_bytes()).unwrap();
        let manifest = unverified.verify(|_, _| true).unwrap();
        assert_eq!(
            (manifest.board, manifest.version, manifest.size),
            ("virt", version, 5000)
        );
        let served = fs::read(folder.path().join(manifest.image.as_str())).unwrap();
        assert_eq!(served, image);
        let one = fs::read(folder.path().join("quill-0.2.0-virt.update")).unwrap();
        let end = manifest_end(&one).unwrap();
        assert_eq!((&one[..end], &one[end..]), (text.as_bytes(), &*image));
        let sums = fs::read_to_string(folder.path().join("virt.sha256")).unwrap();
        assert!(sums.starts_with(&hex(&manifest.sha256)), "{sums}");
        assert_eq!(sums.lines().count(), 3);
        assert!(verify(&text, &key.verifying_key()).is_ok());
        let other = SigningKey::from_bytes(&[4; 32]);
        assert!(verify(&text, &other.verifying_key()).is_err());
    }

    #[test]
    fn the_published_key_and_its_public_half_belong_together() {
        let root = crate::board::root();
        let key = read_key(&root.join(DEVELOPMENT_KEY)).unwrap();
        let public = include_str!("../../firmware/keys/development.pub");
        assert_eq!(public.trim(), hex(key.verifying_key().as_bytes()));
    }
}
