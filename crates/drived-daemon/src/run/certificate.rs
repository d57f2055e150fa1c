//! The certificate of the HTTP server: renewed by a reload, and told when it ends. Behind its end no browser comes in, and the stop of the page
//! is out of reach.

use std::time::Duration;

use tokio::{task::JoinHandle, time::sleep};

use drived_doors::Tls;
use drived_plant::plant::{Plant, views::NoticeView};

/// How often it is looked whether it ends.
const LOOKED: Duration = Duration::from_secs(60);

/// Says when the certificate ends soon or has ended, until another has taken its place.
pub(super) fn follow(certificate: Tls, plant: Plant) -> JoinHandle<()> {
    tokio::spawn(async move {
        let (mut told, mut is_first) = (None, true);
        while !plant.is_closing() {
            let doubt = certificate.doubt();
            if doubt != told {
                let text = doubt.as_deref().unwrap_or("the certificate was renewed");
                // What is so at the start is in the log.
                if !is_first {
                    match doubt.is_some() {
                        true => tracing::warn!("{text}"),
                        false => tracing::info!("{text}"),
                    }
                }
                plant.tell_notice(NoticeView::new("certificate", doubt.is_some(), text));
                told = doubt;
            }
            is_first = false;
            sleep(LOOKED).await;
        }
    })
}
