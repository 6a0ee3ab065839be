//! Decodes a stream from a socket, in the pieces that arrive.

use std::error::Error;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

use dapple_codec::{Decoder, Event, Limits, ModelKind, decode_all};

/// Decodes until the sender hangs up. The result does not depend on where the pieces were cut.
fn receive(mut socket: TcpStream) -> Result<Decoder, Box<dyn Error>> {
    let mut decoder = Decoder::new(Limits::default());
    let mut piece = [0; 1500];
    loop {
        let length = socket.read(&mut piece)?;
        if length == 0 {
            break;
        }
        decoder.push_all(&piece[..length], |_, event| match event {
            Event::Stream(rate) => println!("{} ticks a second", rate.hz()),
            Event::Frame(frame) => {
                let cells = frame.count(ModelKind::Points);
                println!("frame {}: {cells} cells", frame.number);
            }
            _ => {}
        })?;
    }
    decoder.finish_live()?; // A live stream may stop after any commit.
    Ok(decoder)
}

fn main() -> Result<(), Box<dyn Error>> {
    let bytes = sender::stream()?;
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    let sent = bytes.clone();
    let server = thread::spawn(move || -> std::io::Result<()> {
        let (mut socket, _) = listener.accept()?;
        sent.chunks(77)
            .try_for_each(|piece| socket.write_all(piece))
    });
    let decoder = receive(TcpStream::connect(address)?)?;
    server.join().expect("the server does not panic")?;

    // As if all had come at once.
    let whole = decode_all(&bytes, Limits::default(), |_, _| {})?;
    assert_eq!(decoder.last_frame(), Some((sender::FRAMES - 1, 7)));
    assert_eq!(decoder.state_digest(), whole.state_digest());
    Ok(())
}

mod sender {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/sender/mod.rs"
    ));
}
