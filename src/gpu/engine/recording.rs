//! What is to be done, in order: plain data.

use super::pass::Pass;

/// One thing to be done.
#[derive(Debug)]
pub(super) enum Command<'a> {
    Upload {
        name: &'static str,
        bytes: &'a [u8],
    },
    UploadTexels {
        name: &'static str,
        texels: &'a [u8],
        width: u32,
    },
    Clear {
        name: &'static str,
        from: u64,
    },
    Dispatch {
        pass: &'a Pass,
        workgroups: u32,
    },
    Copy {
        from: &'static str,
        to: &'static str,
    },
    Read {
        name: &'static str,
        part: Option<[u32; 2]>,
    },
}

/// Commands for an [`Engine`](super::Engine).
#[derive(Debug, Default)]
pub(in crate::gpu) struct Recording<'a> {
    pub(super) commands: Vec<Command<'a>>,
}

impl<'a> Recording<'a> {
    /// Writes `bytes`, at least 4 and a multiple of it, into the buffer `name`. One of another size is replaced,
    /// one that is not there is made.
    pub(in crate::gpu) fn upload(&mut self, name: &'static str, bytes: &'a [u8]) -> &mut Self {
        self.push(Command::Upload { name, bytes })
    }

    /// Makes the texture `name`, which passes only read, of whole rows of `width` texels of four words. It replaces
    /// any of that name.
    pub(in crate::gpu) fn upload_texels(
        &mut self,
        name: &'static str,
        texels: &'a [u8],
        width: u32,
    ) -> &mut Self {
        self.push(Command::UploadTexels {
            name,
            texels,
            width,
        })
    }

    /// Sets the buffer `name` to zero, from byte `from` on.
    pub(in crate::gpu) fn clear(&mut self, name: &'static str, from: u64) -> &mut Self {
        self.push(Command::Clear { name, from })
    }

    /// Runs `pass`. Beyond the device's limit for one dimension workgroups go on in further rows, of which the
    /// last may be longer than needed.
    pub(in crate::gpu) fn dispatch(&mut self, pass: &'a Pass, workgroups: u32) -> &mut Self {
        self.push(Command::Dispatch { pass, workgroups })
    }

    /// Copies the start of the buffer `from` to all of the texture `to`, which passes only read and which has rows of a
    /// multiple of 16 texels.
    pub(in crate::gpu) fn copy(&mut self, from: &'static str, to: &'static str) -> &mut Self {
        self.push(Command::Copy { from, to })
    }

    /// Reads the buffer `name`. Nothing can be read twice in one recording.
    pub(in crate::gpu) fn read(&mut self, name: &'static str) -> &mut Self {
        self.push(Command::Read { name, part: None })
    }

    /// Reads the upper left part of the texture `name`, of `part` (width and height) texels. Nothing can be
    /// read twice in one recording.
    pub(in crate::gpu) fn read_part(&mut self, name: &'static str, part: [u32; 2]) -> &mut Self {
        let part = Some(part);
        self.push(Command::Read { name, part })
    }

    fn push(&mut self, command: Command<'a>) -> &mut Self {
        self.commands.push(command);
        self
    }
}
